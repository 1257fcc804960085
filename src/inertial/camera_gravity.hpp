// Where gravity pulls in the camera, and how well that is known.
#pragma once

#include "inertial/inertial_state.hpp"

namespace ygslam {

struct CameraGravity {
  Timestamp stamp;
  Vec3 down_camera;  ///< unit vector
  Mat3 covariance;   ///< of it [rad^2], 0 along it
};

[[nodiscard]] CameraGravity camera_gravity_of(const UncertainState& known,
                                              const TiltedGravity& gravity,
                                              const SE3& T_camera_imu);

}  // namespace ygslam
