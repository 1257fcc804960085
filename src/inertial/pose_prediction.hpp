// What an IMU or wheels say of a frame before it is looked at.
#pragma once

#include <optional>

#include "geometry/se3.hpp"

namespace ygslam {

/// Wheels are not asked for longer where the camera is without vision.
inline constexpr double kLongestByWheels_s = 30;

struct PosePrediction {
  SE3 T_odom_camera{};
  Mat6 covariance{};     ///< of T_odom_camera exp(error) [m, rad], translation first
  Vec6 body_velocity{};  ///< the camera's, twist per second in its own frame
  double unseen_s = 0;   ///< since the last frame with a pose
  /// When vision was last there, a second alone would have taken the camera nowhere: this may stand
  /// for vision.
  bool trusted = false;
  bool by_wheels = false;  ///< they hold it: what it errs by grows with the way, not with time
  /// The same from half a second ago, all that vision said since left out: that may have been taken
  /// along by something that moves. Only where agreed.
  struct Earlier {
    SE3 T_odom_camera;
    Mat6 covariance;
  };
  std::optional<Earlier> earlier{};
  bool agreed = false;  ///< with vision for some seconds, until vision was last there
};

}  // namespace ygslam
