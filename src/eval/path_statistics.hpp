// How long and how fast a camera's path is: the columns of Table 1 of the YG-SLAM paper.
#pragma once

#include <optional>
#include <span>

#include "core/time.hpp"
#include "io/trajectory.hpp"

namespace ygslam {

struct PathStatistics {
  double duration_s = 0;
  double length_m = 0;
  double speed_mps = 0;            ///< length / duration
  double angular_speed_degps = 0;  ///< sum of the rotation angles / duration
};

/// Steps are taken between poses at least this far apart: a camera's frame interval. A motion
/// capture system tells poses every 10 ms, and its noise would be added up as if it were motion.
inline constexpr double kPathStep_s = 1.0 / 30;

/// @param poses in order of time. @return nothing for fewer than two poses at different times.
[[nodiscard]] std::optional<PathStatistics> path_statistics(std::span<const StampedPose> poses);
/// The same of the poses between two times (each within slack_s).
[[nodiscard]] std::optional<PathStatistics> path_statistics(std::span<const StampedPose> poses,
                                                            Timestamp from, Timestamp to,
                                                            double slack_s = 0.02);

}  // namespace ygslam
