// What vision says of a frame, for those who go on from it.
#pragma once

#include "geometry/se3.hpp"

namespace ygslam {

/// Variances of each axis, of odom's drift between two frames.
struct OdomDrift {
  double position_m2 = 0, rotation_rad2 = 0;
};

/// A tracked frame's pose. Covariance of T_odom_camera exp(error) [m, rad], translation first.
struct VisualPose {
  SE3 T_odom_camera;
  Mat6 covariance;
  OdomDrift drift{};  ///< since the last frame with a pose
};

}  // namespace ygslam
