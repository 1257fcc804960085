#include "inertial/gyro_turn.hpp"

namespace ygslam {

void GyroTurnSum::add(Timestamp stamp, const Preintegration& measured, const SE3& T_camera_imu) {
  if (!bias_) bias_ = measured.bias();
  const Mat3 R_after_before = measured.corrected(*bias_).R.transpose();
  now_.R_camera_start =
      T_camera_imu.R() * R_after_before * T_camera_imu.R().transpose() * now_.R_camera_start;
  now_.R_camera_start = Eigen::Quaterniond(now_.R_camera_start).normalized().toRotationMatrix();
  now_.variance_rad2 += measured.covariance().topLeftCorner<3, 3>().trace() / 3;
  now_.stamp = stamp;
}

}  // namespace ygslam
