#include "inertial/camera_gravity.hpp"

namespace ygslam {

using namespace state_part;

CameraGravity camera_gravity_of(const UncertainState& known, const TiltedGravity& gravity,
                                const SE3& T_camera_imu) {
  const auto& [state, covariance] = known;
  const Mat3& R_camera_imu = T_camera_imu.R();
  const Mat3 R_imu_odom = state.T_odom_imu.R().transpose();
  const Vec3 down_imu = R_imu_odom * gravity.at(state.tilt) / kStandardGravity_mps2;
  // R exp(phi): down in the IMU turns by -phi.
  Eigen::Matrix<double, 3, 5> J;
  J << skew(down_imu), R_imu_odom * gravity.derivative(state.tilt) / kStandardGravity_mps2;
  Eigen::Matrix<double, 5, 5> of_parts;
  of_parts << covariance.block<3, 3>(kRotation, kRotation),
      covariance.block<3, 2>(kRotation, kTilt), covariance.block<2, 3>(kTilt, kRotation),
      covariance.block<2, 2>(kTilt, kTilt);
  const Mat3 in_imu = J * of_parts * J.transpose();
  return {state.stamp, R_camera_imu * down_imu.normalized(),
          R_camera_imu * in_imu * R_camera_imu.transpose()};
}

}  // namespace ygslam
