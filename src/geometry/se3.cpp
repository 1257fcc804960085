#include "geometry/se3.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

constexpr double kSmallAngle = 1e-5;

// Left Jacobian of SO(3) (Barfoot 2017, eq. 7.77b): t = J * rho.
Mat3 left_jacobian(const Vec3& omega) {
  const double theta = omega.norm();
  const Mat3 W = skew(omega);
  if (theta < kSmallAngle) return Mat3::Identity() + 0.5 * W + W * W / 6.0;
  const double theta2 = theta * theta;
  return Mat3::Identity() + (1.0 - std::cos(theta)) / theta2 * W +
         (theta - std::sin(theta)) / (theta2 * theta) * W * W;
}

}  // namespace

Mat3 skew(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

Mat3 so3_exp(const Vec3& omega) {
  const double theta = omega.norm();
  const Mat3 W = skew(omega);
  if (theta < kSmallAngle) return Mat3::Identity() + W + 0.5 * W * W;
  return Mat3::Identity() + std::sin(theta) / theta * W +
         (1.0 - std::cos(theta)) / (theta * theta) * W * W;
}

Vec3 so3_log(const Mat3& R) {
  Eigen::Quaterniond q(R);
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2.0 * q.vec();
  return 2.0 * std::atan2(sine, q.w()) / sine * q.vec();
}

SE3 SE3::exp(const Vec6& twist) {
  const Vec3 omega = twist.tail<3>();
  return {so3_exp(omega), left_jacobian(omega) * twist.head<3>()};
}

Vec6 SE3::log() const {
  const Vec3 omega = so3_log(R_);
  Vec6 twist;
  twist << left_jacobian(omega).inverse() * t_, omega;
  return twist;
}

Mat6 SE3::adjoint() const {
  Mat6 adjoint = Mat6::Zero();
  adjoint.topLeftCorner<3, 3>() = R_;
  adjoint.topRightCorner<3, 3>() = skew(t_) * R_;
  adjoint.bottomRightCorner<3, 3>() = R_;
  return adjoint;
}

double SE3::angle() const { return so3_log(R_).norm(); }

}  // namespace ygslam
