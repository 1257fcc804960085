// Trajectories written as text in the TUM format: `stamp tx ty tz qx qy qz qw`.
#pragma once

#include <span>
#include <string>

#include "core/time.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

struct StampedPose {
  Timestamp stamp;
  SE3 T_world_camera;
};

/// One line with newline: the stamp with `stamp_decimals` digits, the pose with nine, qw >= 0, '.'
/// in every locale. The pose must be finite.
[[nodiscard]] std::string format_tum(const StampedPose& pose, int stamp_decimals);
/// All lines. Poses that are not finite are left out and logged as an error: better a gap than a
/// NaN.
[[nodiscard]] std::string format_tum(std::span<const StampedPose> poses, int stamp_decimals);

}  // namespace ygslam
