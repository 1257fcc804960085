#include "app/object_truth.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "io/json_text.hpp"

namespace ygslam {
namespace {

Eigen::Vector3d vector_of(const nlohmann::json& json) {
  if (json.size() != 3) throw std::runtime_error("a vector of another length");
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

Timestamp stamp_of(const nlohmann::json& json) {
  constexpr std::int64_t kLast_ns = std::int64_t{1} << 62;
  const auto ns = json.get<std::int64_t>();
  if (!json.is_number_integer() || ns < 0 || ns >= kLast_ns)
    throw std::runtime_error("a time that is none");
  return {ns};
}

std::optional<std::vector<TimeSpan>> spans_at(const nlohmann::json& place, const char* key) {
  const auto found = place.find(key);
  if (found == place.end()) return {};
  if (!found->is_array()) throw std::runtime_error(std::string(key) + ": no list");
  std::vector<TimeSpan> spans;
  for (const nlohmann::json& span : *found) {
    if (span.size() != 2) throw std::runtime_error(std::string(key) + ": no pair of times");
    spans.push_back({stamp_of(span.at(0)), stamp_of(span.at(1))});
  }
  return spans;
}

TruePlace place_of(const nlohmann::json& json) {
  TruePlace place;
  place.box = {vector_of(json.at("centre_m")), vector_of(json.at("size_m")),
               json.at("yaw_rad").get<double>()};
  if (!(place.box.size_m.minCoeff() > 0)) throw std::runtime_error("a box without a volume");
  place.from = stamp_of(json.at("from_ns"));
  place.until = stamp_of(json.at("until_ns"));
  place.frames = json.at("frames").get<int>();
  place.shown = spans_at(json, "shown_ns");
  place.shown_empty = spans_at(json, "shown_empty_ns");
  return place;
}

TrueThing thing_of(const nlohmann::json& json, bool is_group) {
  TrueThing thing{json.at("class").get<std::string>(), is_group, {}};
  for (const nlohmann::json& place : json.at("places")) thing.places.push_back(place_of(place));
  return thing;
}

}  // namespace

std::vector<TrueThing> TrueThings::all() const {
  std::vector<TrueThing> things = named;
  things.insert(things.end(), nameless.begin(), nameless.end());
  return things;
}

Result<TrueThings> parse_true_objects(std::string_view text, const std::string& name) {
  const auto parsed = parse_json(text, name);
  if (!parsed.ok()) return parsed.error();
  const nlohmann::json& json = *parsed;
  try {
    if (json.at("format") != "ygslam true objects") throw std::runtime_error("not true objects");
    TrueThings things;
    for (const nlohmann::json& object : json.at("objects"))
      things.named.push_back(thing_of(object, object.at("group").get<bool>()));
    if (const auto nameless = json.find("nameless"); nameless != json.end())
      for (const nlohmann::json& object : *nameless)
        things.nameless.push_back(thing_of(object, false));
    return things;
  } catch (const std::exception& e) {
    return Error{ErrorKind::kInput, name + ": " + e.what()};
  }
}

}  // namespace ygslam
