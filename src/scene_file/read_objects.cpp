#include "scene_file/read_objects.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "io/text.hpp"
#include "scene_file/objects_file.hpp"

namespace ygslam {
namespace {

template <int kSize>
Eigen::Matrix<double, kSize, 1> numbers_of(const nlohmann::json& json) {
  Eigen::Matrix<double, kSize, 1> values;
  if (json.size() != kSize) throw std::runtime_error("a vector of another length");
  for (int i = 0; i < kSize; ++i) values[i] = json.at(static_cast<std::size_t>(i)).get<double>();
  return values;
}

ObjectState state_of(const std::string& name) {
  for (int i = 0; i <= static_cast<int>(ObjectState::kUnobserved); ++i) {
    const auto state = static_cast<ObjectState>(i);
    if (object_state_name(state) == name) return state;
  }
  throw std::runtime_error("unknown state \"" + name + "\"");
}

SceneObject object_of(const nlohmann::json& json) {
  SceneObject object;
  object.id = static_cast<SceneObjectId>(json.at("id").get<std::uint16_t>());
  object.semantic_class = static_cast<SemanticClass>(json.at("label").get<std::uint8_t>());
  object.probability = json.at("probability").get<float>();
  object.state = state_of(json.at("state").get<std::string>());
  const nlohmann::json& box = json.at("box");
  const Eigen::Vector4d xyzw = numbers_of<4>(box.at("rotation_xyzw"));
  if (!(xyzw.norm() > 0.5)) throw std::runtime_error("a rotation without length");
  const Eigen::Quaterniond q(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  object.box.T_world_box =
      SE3(q.normalized().toRotationMatrix(), numbers_of<3>(box.at("centre_m")));
  object.box.size_m = numbers_of<3>(box.at("size_m"));
  object.views = json.at("views").get<int>();
  object.epochs = json.at("epochs").get<int>();
  object.first_seen.ns = json.at("first_seen_ns").get<std::int64_t>();
  object.last_seen.ns = json.at("last_seen_ns").get<std::int64_t>();
  return object;
}

}  // namespace

Result<SceneObjects> parse_objects(std::string_view text, const std::string& name) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    if (json.at("format") != "ygslam objects") throw std::runtime_error("not an objects file");
    SceneObjects scene;
    scene.gravity.up_world = numbers_of<3>(json.at("up_world"));
    if (!(scene.gravity.up_world.norm() > 0.5)) throw std::runtime_error("up without length");
    scene.gravity.floor_m = json.at("floor_m").get<double>();
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
