#include "inertial/gyro_turn.hpp"

namespace ygslam {

void GyroTurnSum::add(Timestamp stamp, const Preintegration& measured, const SE3& T_camera_imu) {
  if (!bias_) bias_ = measured.bias();
  const auto [turn_rad, std_rad] = camera_turn(measured, *bias_, T_camera_imu);
  now_.R_camera_start = so3_exp(-turn_rad) * now_.R_camera_start;
  now_.R_camera_start = Eigen::Quaterniond(now_.R_camera_start).normalized().toRotationMatrix();
  now_.variance_rad2 += std_rad * std_rad;
  now_.stamp = stamp;
}

}  // namespace ygslam
