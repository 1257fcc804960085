// What vision says of a frame, for those who go on from it.
#pragma once

#include "geometry/se3.hpp"

namespace ygslam {

/// A tracked frame's pose. Covariance of T_odom_camera exp(error) [m, rad], translation first.
struct VisualPose {
  SE3 T_odom_camera;
  Mat6 covariance;
};

}  // namespace ygslam
