#include "mapping/full_adjustment.hpp"

#include "core/trace.hpp"

namespace ygslam {

FullAdjustment make_full_adjustment(const Map& map, const NoiseConfig& noise) {
  FullAdjustment job{make_whole_window(map, noise), map.start_patch()};
  for (const KeyframeId id : job.window.keyframes) {
    const SE3& T_camera_world = map.keyframe(id).T_camera_world;
    job.patch.poses.push_back({id, T_camera_world, T_camera_world});
  }
  for (const LandmarkId id : job.window.landmarks) {
    const Vec3& p_world = map.landmark(id).p_world;
    job.patch.points.push_back({id, p_world, p_world});
  }
  return job;
}

std::optional<MapPatch> solve(const Camera& camera, FullAdjustment job, const BundleConfig& config,
                              const std::atomic<bool>* abort) {
  const trace::Span span("adjust the whole map");
  const BundleResult result = adjust_bundle(camera, job.window.problem, config, abort);
  if (!result.usable || result.interrupted) return std::nullopt;
  const SE3 T_world_local = job.window.T_local_world.inverse();
  for (std::size_t i = 0; i < job.patch.poses.size(); ++i) {
    if (!job.window.problem.poses[i].fixed)
      job.patch.poses[i].T_camera_world =
          (result.T_camera_world[i] * job.window.T_local_world).normalized();
  }
  for (std::size_t i = 0; i < job.patch.points.size(); ++i)
    job.patch.points[i].p_world = T_world_local * result.points_world[i];
  return std::move(job.patch);
}

}  // namespace ygslam
