// How the camera turns, by its gyroscope.
#pragma once

#include "inertial/preintegration.hpp"

namespace ygslam {

struct CameraTurn {
  Vec3 turn_rad = Vec3::Zero();  ///< R_before_after = so3_exp(turn_rad), in the camera's axes
  double std_rad = 0;            ///< about one axis
};

/// While this was measured, had the gyroscope's bias been this one; std_rad is by its white noise
/// alone.
[[nodiscard]] CameraTurn camera_turn(const Preintegration& measured, const ImuBias& bias,
                                     const SE3& T_camera_imu);

}  // namespace ygslam
