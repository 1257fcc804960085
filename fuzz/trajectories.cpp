#include <cmath>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/trajectory_checks.hpp"
#include "io/trajectory_formats.hpp"

namespace ygslam::fuzz {

void trajectories(std::string_view bytes) {
  for (const auto format :
       {std::optional<TrajectoryFormat>(), std::optional(TrajectoryFormat::kTum),
        std::optional(TrajectoryFormat::kKitti), std::optional(TrajectoryFormat::kEuroc)}) {
    const auto trajectory = parse_trajectory(bytes, "trajectory.txt", {.format = format});
    if (!trajectory.ok()) continue;
    CHECK(!trajectory->poses.empty());
    for (const StampedPose& pose : trajectory->poses) {
      CHECK(pose.T_world_camera.is_finite());
      CHECK(std::abs(pose.T_world_camera.R().determinant() - 1) < 0.1, "no reflection");
    }
    for (std::size_t i = 1; i < trajectory->poses.size(); ++i)
      CHECK(trajectory->poses[i - 1].stamp < trajectory->poses[i].stamp);
    CHECK(trajectory->taken_for.find('\n') == std::string::npos);
    (void)format_tum(trajectory->poses, 6);
  }
  const auto poses = parse_tum_trajectory(bytes, "trajectory.txt");
  if (!poses.ok()) return;
  for (std::size_t i = 1; i < poses->size(); ++i) CHECK((*poses)[i - 1].stamp < (*poses)[i].stamp);
}

}  // namespace ygslam::fuzz
