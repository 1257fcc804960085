#include "scene_file/read_objects.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "io/json_text.hpp"
#include "io/text.hpp"
#include "scene_file/objects_file.hpp"

namespace ygslam {
namespace {

constexpr double kFarthest_m = 1e9;  // squares and micrometres still are numbers

double metres_of(const nlohmann::json& json) {
  const double value = json.get<double>();
  if (!(std::abs(value) <= kFarthest_m)) throw std::runtime_error("a number beyond 10^9 m");
  return value;
}

template <int kSize>
Eigen::Matrix<double, kSize, 1> numbers_of(const nlohmann::json& json) {
  Eigen::Matrix<double, kSize, 1> values;
  if (json.size() != kSize) throw std::runtime_error("a vector of another length");
  for (int i = 0; i < kSize; ++i) values[i] = metres_of(json.at(static_cast<std::size_t>(i)));
  return values;
}

template <typename T>
T whole_number_of(const nlohmann::json& json) {
  if (!json.is_number_integer()) throw std::runtime_error("a number that is not whole");
  const bool fits = json.is_number_unsigned() ? std::in_range<T>(json.get<std::uint64_t>())
                                              : std::in_range<T>(json.get<std::int64_t>());
  if (!fits) throw std::runtime_error("a number out of its range");
  return json.get<T>();
}

ObjectState state_of(const std::string& name) {
  for (int i = 0; i <= static_cast<int>(ObjectState::kUnobserved); ++i) {
    const auto state = static_cast<ObjectState>(i);
    if (object_state_name(state) == name) return state;
  }
  throw std::runtime_error("unknown state \"" + name + "\"");
}

OrientedBox box_of(const nlohmann::json& json) {
  const Eigen::Vector4d xyzw = numbers_of<4>(json.at("rotation_xyzw"));
  if (!(xyzw.norm() > 0.5)) throw std::runtime_error("a rotation without length");
  const Eigen::Quaterniond q(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  const Vec3 size_m = numbers_of<3>(json.at("size_m"));
  if (size_m.minCoeff() < 0) throw std::runtime_error("a box of negative size");
  return {SE3(q.normalized().toRotationMatrix(), numbers_of<3>(json.at("centre_m"))), size_m};
}

Timestamp stamp_of(const nlohmann::json& json, const char* key) {
  return {whole_number_of<std::int64_t>(json.at(key))};
}

SceneObject object_of(const nlohmann::json& json) {
  SceneObject object;
  object.id = static_cast<SceneObjectId>(whole_number_of<std::uint16_t>(json.at("id")));
  object.semantic_class =
      static_cast<SemanticClass>(whole_number_of<std::uint8_t>(json.at("label")));
  const double probability = json.at("probability").get<double>();
  if (!(probability >= 0 && probability <= 1)) throw std::runtime_error("no probability");
  object.probability = static_cast<float>(probability);
  object.state = state_of(json.at("state").get<std::string>());
  object.box = box_of(json.at("box"));
  object.views = whole_number_of<int>(json.at("views"));
  object.epochs = whole_number_of<int>(json.at("epochs"));
  object.first_seen = stamp_of(json, "first_seen_ns");
  object.last_seen = stamp_of(json, "last_seen_ns");
  if (json.contains("known_ns")) object.known = stamp_of(json, "known_ns");
  if (json.contains("found_empty_ns")) object.found_empty = stamp_of(json, "found_empty_ns");
  for (const nlohmann::json& place : json.value("earlier", nlohmann::json::array())) {
    object.earlier.push_back({box_of(place.at("box")), stamp_of(place, "first_seen_ns"),
                              stamp_of(place, "last_seen_ns"), stamp_of(place, "found_empty_ns")});
  }
  return object;
}

}  // namespace

Result<SceneObjects> parse_objects(std::string_view text, const std::string& name) {
  const auto parsed = parse_json(text, name);
  if (!parsed.ok()) return parsed.error();
  const nlohmann::json& json = *parsed;
  try {
    if (json.at("format") != "ygslam objects") throw std::runtime_error("not an objects file");
    SceneObjects scene;
    scene.gravity.up_world = numbers_of<3>(json.at("up_world"));
    if (!(scene.gravity.up_world.norm() > 0.5)) throw std::runtime_error("up without length");
    scene.gravity.floor_m = metres_of(json.at("floor_m"));
    for (const nlohmann::json& object : json.at("objects"))
      scene.objects.push_back(object_of(object));
    return scene;
  } catch (const std::exception& e) {
    return Error{ErrorKind::kInput, name + ": " + e.what()};
  }
}

Result<SceneObjects> read_objects(const std::filesystem::path& path) {
  const auto bytes = read_file(path, std::size_t{64} << 20);
  if (!bytes.ok()) return bytes.error();
  return parse_objects(*bytes, path.string());
}

}  // namespace ygslam
