#include "geometry/se3.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/so3_jacobian.hpp"

namespace ygslam {
namespace {

constexpr double kSmallAngle = 1e-5;

// Upper right block of the left Jacobian of SE(3) (Barfoot 2017, eq. 7.86b).
Mat3 left_jacobian_coupling(const Vec3& rho, const Vec3& omega) {
  const double theta = omega.norm();
  const double theta2 = theta * theta;
  // Series below this angle: the closed forms lose digits there.
  constexpr double kSeriesAngle = 0.1;
  double a = 1.0 / 6 - theta2 / 120 + theta2 * theta2 / 5040;
  double b = 1.0 / 24 - theta2 / 720 + theta2 * theta2 / 40320;
  double c = 1.0 / 120 - theta2 / 2520 + theta2 * theta2 / 120960;
  if (theta > kSeriesAngle) {
    const double sine = std::sin(theta), cosine = std::cos(theta);
    a = (theta - sine) / (theta2 * theta);
    b = (theta2 + 2 * cosine - 2) / (2 * theta2 * theta2);
    c = (2 * theta - 3 * sine + theta * cosine) / (2 * theta2 * theta2 * theta);
  }
  const Mat3 P = skew(omega), R = skew(rho);
  const Mat3 PR = P * R, RP = R * P, PRP = PR * P;
  return 0.5 * R + a * (PR + RP + PRP) + b * (P * PR + RP * P - 3 * PRP) + c * (PRP * P + P * PRP);
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

Mat3 so3_left_jacobian(const Vec3& omega) {
  const double theta = omega.norm();
  const Mat3 W = skew(omega);
  if (theta < kSmallAngle) return Mat3::Identity() + 0.5 * W + W * W / 6.0;
  const double theta2 = theta * theta;
  return Mat3::Identity() + (1.0 - std::cos(theta)) / theta2 * W +
         (theta - std::sin(theta)) / (theta2 * theta) * W * W;
}

SE3 SE3::exp(const Vec6& twist) {
  const Vec3 omega = twist.tail<3>();
  return {so3_exp(omega), so3_left_jacobian(omega) * twist.head<3>()};
}

Vec6 SE3::log() const {
  const Vec3 omega = so3_log(R_);
  Vec6 twist;
  twist << so3_left_jacobian(omega).inverse() * t_, omega;
  return twist;
}

Mat6 SE3::adjoint() const {
  Mat6 adjoint = Mat6::Zero();
  adjoint.topLeftCorner<3, 3>() = R_;
  adjoint.topRightCorner<3, 3>() = skew(t_) * R_;
  adjoint.bottomRightCorner<3, 3>() = R_;
  return adjoint;
}

Mat6 se3_left_jacobian_inverse(const Vec6& twist) {
  const Vec3 omega = twist.tail<3>();
  const Mat3 inverse = so3_left_jacobian(omega).inverse();
  Mat6 result = Mat6::Zero();
  result.topLeftCorner<3, 3>() = result.bottomRightCorner<3, 3>() = inverse;
  result.topRightCorner<3, 3>() =
      -inverse * left_jacobian_coupling(twist.head<3>(), omega) * inverse;
  return result;
}

double SE3::angle() const { return so3_log(R_).norm(); }

}  // namespace ygslam
