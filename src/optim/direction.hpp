// A direction of the world that was measured in a camera, gravity's for one: it says how the camera
// is turned about all axes but that direction.
#pragma once

#include <cstdint>
#include <span>

#include "geometry/se3.hpp"

namespace ygslam {

/// Its residual is e = R_camera_world * direction_world - direction_camera.
struct MeasuredDirection {
  std::uint32_t pose = 0;  ///< index into the poses of the problem
  Vec3 direction_world = Vec3::UnitZ();
  Vec3 direction_camera = Vec3::UnitZ();
  Mat3 information = Mat3::Identity();  ///< inverse covariance of e, symmetric [1/rad^2]
};

[[nodiscard]] Vec3 direction_residual(const MeasuredDirection& direction,
                                      const SE3& T_camera_world);
/// d e / d omega for T <- exp((rho, omega)) * T; by rho it is 0.
[[nodiscard]] Mat3 direction_jacobian(const MeasuredDirection& direction,
                                      const SE3& T_camera_world);

/// 1/2 sum of e^T information e.
[[nodiscard]] double direction_cost(std::span<const MeasuredDirection> directions,
                                    std::span<const SE3> T_camera_world);
/// Adds what it says to the normal equations of its pose.
void add_direction(const MeasuredDirection& direction, const SE3& T_camera_world,
                   Eigen::Ref<Mat6, 0, Eigen::OuterStride<>> H, Eigen::Ref<Vec6> g);

[[nodiscard]] inline bool is_finite(const MeasuredDirection& direction) {
  return direction.direction_world.allFinite() && direction.direction_camera.allFinite() &&
         direction.information.allFinite();
}

}  // namespace ygslam
