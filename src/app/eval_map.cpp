#include "app/eval_map.hpp"

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/object_truth.hpp"
#include "app/scene_input.hpp"
#include "app/surface_truth.hpp"
#include "eval/alignment.hpp"
#include "eval/hand_eye.hpp"
#include "io/text.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

// Where the map's frame lies in the truth's.
Result<SE3> align_map(const MapEvalArguments& a) {
  if (a.trajectory.empty()) return SE3();
  std::error_code code;
  const bool is_folder = fs::is_directory(a.truth, code);
  if (a.true_trajectory.empty() && !is_folder)
    return Error{ErrorKind::kUsage, "--est: needs --gt, the true trajectory"};
  fs::path file = a.true_trajectory;
  if (file.empty()) file = fs::path(a.truth) / "groundtruth.txt";
  const auto truth = read_trajectory(file);
  if (!truth.ok()) return truth.error();
  const auto estimate = read_trajectory(a.trajectory);
  if (!estimate.ok()) return estimate.error();
  const PosePairs pairs = associate(truth_of_camera(truth->poses, estimate->poses, a.max_diff_s),
                                    estimate->poses, a.max_diff_s);
  if (pairs.size() == 0)
    return Error{ErrorKind::kInput, a.trajectory + ": no stamp in common with " + file.string()};
  return align_with_orientations(pairs).T_truth_estimate;
}

bool stands_there(const SceneObject& object) {
  return object.state == ObjectState::kStatic || object.state == ObjectState::kSettled ||
         object.state == ObjectState::kUnobserved;
}

struct ObjectJudgement {
  ObjectScore objects;
  ChangeScore changes;
};

UprightBox upright(const SE3& T_truth_map, const OrientedBox& box) {
  const SE3 T = T_truth_map * box.T_world_box;
  return {T.t(), box.size_m, std::atan2(T.R()(1, 0), T.R()(0, 0))};
}

MappedThing mapped_thing(const SceneObject& object, const SE3& T_truth_map) {
  MappedThing thing{semantic_class_name(object.semantic_class), {}};
  for (const EarlierPlace& place : object.earlier)
    thing.places.push_back({upright(T_truth_map, place.box), {}, place.found_empty});
  thing.places.push_back({upright(T_truth_map, object.box), object.known, object.found_empty});
  return thing;
}

// Nothing where the truth tells of no things.
Result<std::optional<TrueThings>> read_things(const fs::path& truth) {
  std::error_code code;
  const fs::path file = truth / "true_objects.json";
  if (!fs::exists(file, code)) return std::optional<TrueThings>();
  const auto bytes = read_file(file, std::size_t{64} << 20);
  if (!bytes.ok()) return bytes.error();
  auto things = parse_true_objects(*bytes, file.string());
  if (!things.ok()) return things.error();
  return std::optional(std::move(*things));
}

ObjectJudgement judge_objects(const std::vector<TrueThing>& things, const SceneInput& scene,
                              const SE3& T_truth_map) {
  std::vector<FoundObject> standing;
  std::vector<MappedThing> found;
  for (const SceneObject& object : scene.objects) {
    if (!stands_there(object) && object.state != ObjectState::kAbsent) continue;
    found.push_back(mapped_thing(object, T_truth_map));
    if (stands_there(object))
      standing.push_back({found.back().class_name, found.back().places.back().box});
  }
  return {score_objects(standing, standing_at_end(things)), score_changes(found, things)};
}

}  // namespace

Result<std::string> eval_map(const MapEvalArguments& a) {
  const auto T_truth_map = align_map(a);
  if (!T_truth_map.ok()) return T_truth_map.error();
  auto scene = read_scene_input(a.map);
  if (!scene.ok()) return scene.error();
  const auto things = read_things(a.truth);
  if (!things.ok()) return things.error();
  std::optional<ObjectJudgement> objects;
  if (*things && scene->has_objects)
    objects = judge_objects((*things)->named, *scene, *T_truth_map);
  Surface map{{}, std::move(scene->mesh.triangles)};
  for (const SurfacePoint& point : scene->mesh.vertices) {
    map.points.emplace_back((*T_truth_map * point.p_world.cast<double>()).cast<float>());
  }
  if (Status fits = check_area(map, a.map); !fits.ok()) return fits.error();
  auto truth = read_surface_truth(a.truth);
  if (!truth.ok()) return truth.error();
  if (*things) {
    truth->moved = moved_and_standing((*things)->all());
    truth->left_unseen = left_unseen((*things)->all());
  }
  const SurfaceScore score = score_surface(map, *truth);
  if (!a.json) {
    std::string text = format_surface(score, a.map);
    if (objects) text += format_objects(objects->objects) + format_changes(objects->changes);
    return text;
  }
  nlohmann::json json = to_json(score);
  json["map"] = a.map;
  json["objects"] = json["changes"] = nullptr;
  if (objects) {
    json["objects"] = to_json(objects->objects);
    json["changes"] = to_json(objects->changes);
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace ygslam
