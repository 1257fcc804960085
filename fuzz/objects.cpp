#include <cmath>

#include <nlohmann/json.hpp>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "scene/floor_frame.hpp"
#include "scene_file/objects_file.hpp"
#include "scene_file/read_objects.hpp"

namespace ygslam::fuzz {

/// What is accepted has boxes that are boxes, and can be written and read again.
void objects(std::string_view bytes) {
  const auto scene = parse_objects(bytes, "objects.json");
  if (!scene.ok()) return;
  CHECK(T_world_floor(scene->gravity).is_finite());
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(bytes);
  json["objects"] = nlohmann::ordered_json::array();
  for (const SceneObject& object : scene->objects) {
    CHECK(object.box.T_world_box.is_finite() && object.box.size_m.minCoeff() >= 0);
    CHECK(std::abs(object.box.T_world_box.R().determinant() - 1) < 1e-9);
    json["objects"].push_back(object_json(object, scene->gravity));
  }
  const auto again = parse_objects(json.dump(), "objects.json");
  CHECK(again.ok(), again.ok() ? "" : again.error().message.c_str());
  CHECK(again->objects.size() == scene->objects.size());
}

}  // namespace ygslam::fuzz
