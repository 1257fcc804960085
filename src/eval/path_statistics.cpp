#include "eval/path_statistics.hpp"

#include <algorithm>
#include <numbers>

namespace ygslam {
namespace {

// Stamps are rounded and jitter; a step that is short by this much still counts as one.
constexpr double kStepSlack_s = 0.002;

}  // namespace

std::optional<PathStatistics> path_statistics(std::span<const StampedPose> poses) {
  if (poses.size() < 2) return std::nullopt;
  PathStatistics figures;
  double angle_rad = 0;
  const StampedPose* before = &poses.front();
  for (const StampedPose& pose : poses.subspan(1)) {
    const bool is_last = &pose == &poses.back();
    if (!is_last && seconds_between(pose.stamp, before->stamp) < kPathStep_s - kStepSlack_s) {
      continue;
    }
    const SE3 T_before_now = before->T_world_camera.inverse() * pose.T_world_camera;
    figures.length_m += T_before_now.t().norm();
    angle_rad += T_before_now.angle();
    before = &pose;
  }
  figures.duration_s = seconds_between(poses.back().stamp, poses.front().stamp);
  if (figures.duration_s <= 0) return std::nullopt;
  figures.speed_mps = figures.length_m / figures.duration_s;
  figures.angular_speed_degps = angle_rad / figures.duration_s * 180 / std::numbers::pi;
  return figures;
}

std::optional<PathStatistics> path_statistics(std::span<const StampedPose> poses, Timestamp from,
                                              Timestamp to, double slack_s) {
  const auto earlier = [](const StampedPose& pose, std::int64_t ns) { return pose.stamp.ns < ns; };
  const auto begin =
      std::lower_bound(poses.begin(), poses.end(), from.ns - to_ns(slack_s), earlier);
  const auto end = std::lower_bound(begin, poses.end(), to.ns + to_ns(slack_s) + 1, earlier);
  return path_statistics(poses.subspan(static_cast<std::size_t>(begin - poses.begin()),
                                       static_cast<std::size_t>(end - begin)));
}

}  // namespace ygslam
