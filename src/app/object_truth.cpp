#include "app/object_truth.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "io/json_text.hpp"

namespace ygslam {
namespace {

Eigen::Vector3d vector_of(const nlohmann::json& json) {
  if (json.size() != 3) throw std::runtime_error("a vector of another length");
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

TruePlace place_of(const nlohmann::json& json) {
  TruePlace place;
  place.box = {vector_of(json.at("centre_m")), vector_of(json.at("size_m")),
               json.at("yaw_rad").get<double>()};
  if (!(place.box.size_m.minCoeff() > 0)) throw std::runtime_error("a box without a volume");
  place.from.ns = json.at("from_ns").get<std::int64_t>();
  place.until.ns = json.at("until_ns").get<std::int64_t>();
  place.frames = json.at("frames").get<int>();
  return place;
}

}  // namespace

Result<std::vector<TrueThing>> parse_true_objects(std::string_view text, const std::string& name) {
  const auto parsed = parse_json(text, name);
  if (!parsed.ok()) return parsed.error();
  const nlohmann::json& json = *parsed;
  try {
    if (json.at("format") != "ygslam true objects") throw std::runtime_error("not true objects");
    std::vector<TrueThing> things;
    for (const nlohmann::json& object : json.at("objects")) {
      TrueThing thing{object.at("class").get<std::string>(), object.at("group").get<bool>(), {}};
      for (const nlohmann::json& place : object.at("places"))
        thing.places.push_back(place_of(place));
      things.push_back(std::move(thing));
    }
    return things;
  } catch (const std::exception& e) {
    return Error{ErrorKind::kInput, name + ": " + e.what()};
  }
}

}  // namespace ygslam
