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

/// @throws std::runtime_error, as all below, in words for the user.
const nlohmann::json& field_of(const nlohmann::json& json, const char* key) {
  if (!json.is_object()) throw std::runtime_error("no object where one is expected");
  const auto found = json.find(key);
  if (found == json.end()) throw std::runtime_error("'" + std::string(key) + "' is missing");
  return *found;
}

const nlohmann::json& list_of(const nlohmann::json& json) {
  if (!json.is_array()) throw std::runtime_error("no list where one is expected");
  return json;
}

double number_of(const nlohmann::json& json) {
  if (!json.is_number()) throw std::runtime_error("no number where one is expected");
  return json.get<double>();
}

std::string word_of(const nlohmann::json& json) {
  if (!json.is_string()) throw std::runtime_error("no text where it is expected");
  return json.get<std::string>();
}

/// What is said of a part names it.
template <typename Read>
auto part_of(const nlohmann::json& json, const char* key, const Read& read) {
  const nlohmann::json& part = field_of(json, key);
  try {
    return read(part);
  } catch (const std::runtime_error& fault) {
    throw std::runtime_error(std::string(key) + ": " + fault.what());
  }
}

double metres_of(const nlohmann::json& json) {
  const double value = number_of(json);
  if (!(std::abs(value) <= kFarthest_m)) throw std::runtime_error("a number beyond 10^9 m");
  return value;
}

template <int kSize>
Eigen::Matrix<double, kSize, 1> numbers_of(const nlohmann::json& json) {
  Eigen::Matrix<double, kSize, 1> values;
  if (list_of(json).size() != kSize) throw std::runtime_error("a vector of another length");
  for (int i = 0; i < kSize; ++i) values[i] = metres_of(json[static_cast<std::size_t>(i)]);
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
  throw std::runtime_error("unknown state '" + printable(name) + "'");
}

Eigen::Quaterniond rotation_of(const nlohmann::json& json) {
  const Eigen::Vector4d xyzw = numbers_of<4>(json);
  if (!(xyzw.norm() > 0.5)) throw std::runtime_error("a rotation without length");
  return Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).normalized();
}

Vec3 size_of(const nlohmann::json& json) {
  Vec3 size_m = numbers_of<3>(json);
  if (size_m.minCoeff() < 0) throw std::runtime_error("a box of negative size");
  return size_m;
}

OrientedBox box_of(const nlohmann::json& json) {
  const Eigen::Quaterniond rotation = part_of(json, "rotation_xyzw", rotation_of);
  return {SE3(rotation.toRotationMatrix(), part_of(json, "centre_m", numbers_of<3>)),
          part_of(json, "size_m", size_of)};
}

Timestamp stamp_of(const nlohmann::json& json, const char* key) {
  return {part_of(json, key, whole_number_of<std::int64_t>)};
}

float probability_of(const nlohmann::json& json) {
  const double probability = number_of(json);
  if (!(probability >= 0 && probability <= 1)) throw std::runtime_error("not within 0 and 1");
  return static_cast<float>(probability);
}

SceneObject object_of(const nlohmann::json& json) {
  SceneObject object;
  object.id = static_cast<SceneObjectId>(part_of(json, "id", whole_number_of<std::uint16_t>));
  object.semantic_class =
      static_cast<SemanticClass>(part_of(json, "label", whole_number_of<std::uint8_t>));
  object.probability = part_of(json, "probability", probability_of);
  object.state = state_of(part_of(json, "state", word_of));
  object.box = part_of(json, "box", box_of);
  object.views = part_of(json, "views", whole_number_of<int>);
  object.epochs = part_of(json, "epochs", whole_number_of<int>);
  object.first_seen = stamp_of(json, "first_seen_ns");
  object.last_seen = stamp_of(json, "last_seen_ns");
  if (json.contains("known_ns")) object.known = stamp_of(json, "known_ns");
  if (json.contains("found_empty_ns")) object.found_empty = stamp_of(json, "found_empty_ns");
  if (!json.contains("earlier")) return object;
  for (const nlohmann::json& place : list_of(json["earlier"])) {
    object.earlier.push_back({part_of(place, "box", box_of), stamp_of(place, "first_seen_ns"),
                              stamp_of(place, "last_seen_ns"), stamp_of(place, "found_empty_ns")});
  }
  return object;
}

std::vector<SceneObject> objects_of(const nlohmann::json& json) {
  std::vector<SceneObject> objects;
  for (const nlohmann::json& object : list_of(json)) {
    try {
      objects.push_back(object_of(object));
    } catch (const std::runtime_error& fault) {
      throw std::runtime_error("number " + std::to_string(objects.size() + 1) + ": " +
                               fault.what());
    }
  }
  return objects;
}

Vec3 up_of(const nlohmann::json& json) {
  Vec3 up = numbers_of<3>(json);
  if (!(up.norm() > 0.5)) throw std::runtime_error("without length");
  return up;
}

}  // namespace

Result<SceneObjects> parse_objects(std::string_view text, const std::string& name) {
  const auto parsed = parse_json(text, name);
  if (!parsed.ok()) return parsed.error();
  const nlohmann::json& json = *parsed;
  try {
    if (part_of(json, "format", word_of) != "ygslam objects")
      throw std::runtime_error("not an objects file");
    SceneObjects scene;
    scene.gravity.up_world = part_of(json, "up_world", up_of);
    scene.gravity.floor_m = part_of(json, "floor_m", metres_of);
    scene.objects = part_of(json, "objects", objects_of);
    return scene;
  } catch (const std::runtime_error& e) {
    return Error{ErrorKind::kInput, name + ": " + e.what()};
  }
}

Result<SceneObjects> read_objects(const std::filesystem::path& path) {
  const auto bytes = read_file(path, std::size_t{64} << 20);
  if (!bytes.ok()) return bytes.error();
  return parse_objects(*bytes, path.string());
}

}  // namespace ygslam
