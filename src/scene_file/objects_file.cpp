#include "scene_file/objects_file.hpp"

#include <cmath>

#include "io/atomic_file.hpp"
#include "scene/class_colour.hpp"
#include "scene/floor_frame.hpp"

namespace ygslam {
namespace {

using Json = nlohmann::ordered_json;

// Micrometres and microradians are enough, and short.
double rounded(double value) {
  CHECK(std::isfinite(value), "JSON has no number for this");
  return std::round(value * 1e6) / 1e6 + 0.0;  // no minus zero
}

Json vector_json(const Vec3& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }

Json rotation_json(const SE3& T) {
  Eigen::Quaterniond q = T.quaternion();
  if (q.w() < 0) q.coeffs() *= -1;
  return {rounded(q.x()), rounded(q.y()), rounded(q.z()), rounded(q.w())};
}

Json box_json(const OrientedBox& box, const Gravity& gravity) {
  return {{"centre_m", vector_json(box.T_world_box.t())},
          {"size_m", vector_json(box.size_m)},
          {"yaw_rad", rounded(box_yaw(box, gravity))},
          {"rotation_xyzw", rotation_json(box.T_world_box)}};
}

Status write_json(const std::filesystem::path& path, const Json& json) {
  return write_file_atomically(path, json.dump(1) + "\n");
}

}  // namespace

std::string object_state_name(ObjectState state) {
  switch (state) {
    case ObjectState::kCandidate:
      return "candidate";
    case ObjectState::kStatic:
      return "static";
    case ObjectState::kMoving:
      return "moving";
    case ObjectState::kSettled:
      return "settled";
    case ObjectState::kAbsent:
      return "absent";
    case ObjectState::kUnobserved:
      return "unobserved";
  }
  CHECK(false, "no such state");
  return {};
}

std::string object_name(const SceneObject& object) {
  return semantic_class_name(object.semantic_class) + " " +
         std::to_string(static_cast<int>(object.id));
}

Json object_json(const SceneObject& object, const Gravity& gravity) {
  Json json = {{"id", static_cast<int>(object.id)},
               {"class", semantic_class_name(object.semantic_class)},
               {"label", static_cast<int>(object.semantic_class)},
               {"probability", rounded(object.probability)},
               {"state", object_state_name(object.state)},
               {"box", box_json(object.box, gravity)},
               {"views", object.views},
               {"epochs", object.epochs},
               {"first_seen_ns", object.first_seen.ns},
               {"last_seen_ns", object.last_seen.ns}};
  if (object.known) json["known_ns"] = object.known->ns;
  if (object.found_empty) json["found_empty_ns"] = object.found_empty->ns;
  for (const EarlierPlace& place : object.earlier) {
    json["earlier"].push_back({{"box", box_json(place.box, gravity)},
                               {"first_seen_ns", place.first_seen.ns},
                               {"last_seen_ns", place.last_seen.ns},
                               {"found_empty_ns", place.found_empty.ns}});
  }
  return json;
}

Status write_objects(const std::filesystem::path& path, std::span<const SceneObject> objects,
                     const Gravity& gravity) {
  const SE3 T_world = T_world_floor(gravity);
  Json json = {
      {"format", "ygslam objects"},
      {"version", 1},
      {"up_world", vector_json(gravity.up_world.normalized())},
      {"floor_m", rounded(gravity.floor_m)},
      {"world_from_floor",
       {{"translation_m", vector_json(T_world.t())}, {"rotation_xyzw", rotation_json(T_world)}}},
      {"objects", Json::array()}};
  for (const SceneObject& object : objects) json["objects"].push_back(object_json(object, gravity));
  return write_json(path, json);
}

Status write_labels(const std::filesystem::path& path) {
  Json json = {{"format", "ygslam labels"}, {"version", 1}, {"labels", Json::array()}};
  for (const SemanticClass semantic_class : all_semantic_classes()) {
    const Rgb8 colour = class_colour(semantic_class);
    json["labels"].push_back({{"label", static_cast<int>(semantic_class)},
                              {"name", semantic_class_name(semantic_class)},
                              {"colour", {colour.r, colour.g, colour.b}}});
  }
  return write_json(path, json);
}

}  // namespace ygslam
