#include "app/eval_map.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/scene_input.hpp"
#include "app/surface_truth.hpp"
#include "eval/alignment.hpp"
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
  const PosePairs pairs = associate(truth->poses, estimate->poses, a.max_diff_s);
  if (pairs.size() == 0)
    return Error{ErrorKind::kInput, a.trajectory + ": no stamp in common with " + file.string()};
  return align_with_orientations(pairs).T_truth_estimate;
}

}  // namespace

Result<std::string> eval_map(const MapEvalArguments& a) {
  const auto T_truth_map = align_map(a);
  if (!T_truth_map.ok()) return T_truth_map.error();
  auto scene = read_scene_input(a.map);
  if (!scene.ok()) return scene.error();
  Surface map{{}, std::move(scene->mesh.triangles)};
  for (const SurfacePoint& point : scene->mesh.vertices) {
    map.points.emplace_back((*T_truth_map * point.p_world.cast<double>()).cast<float>());
  }
  const auto truth = read_surface_truth(a.truth);
  if (!truth.ok()) return truth.error();
  const SurfaceScore score = score_surface(map, *truth);
  if (!a.json) return format_surface(score, a.map);
  nlohmann::json json = to_json(score);
  json["map"] = a.map;
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace ygslam
