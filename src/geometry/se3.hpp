// Rigid motions. A pose T_target_source takes a point from the source frame to the target frame:
// p_target = T_target_source * p_source.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace ygslam {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;

/// Cross-product matrix: skew(a) * b = a x b.
[[nodiscard]] Mat3 skew(const Vec3& a);
/// Rotation by the angle |omega| [rad] about omega (Rodrigues).
[[nodiscard]] Mat3 so3_exp(const Vec3& omega);
/// Inverse of so3_exp, angle in [0, pi].
[[nodiscard]] Vec3 so3_log(const Mat3& R);

/// An element of SE(3); rotation kept as a matrix because points are transformed far more often
/// than poses are composed.
class SE3 {
 public:
  SE3() : R_(Mat3::Identity()), t_(Vec3::Zero()) {}
  SE3(const Mat3& R, const Vec3& t) : R_(R), t_(t) {}
  SE3(const Eigen::Quaterniond& q, const Vec3& t) : R_(q.normalized().toRotationMatrix()), t_(t) {}

  [[nodiscard]] const Mat3& R() const { return R_; }
  [[nodiscard]] const Vec3& t() const { return t_; }
  [[nodiscard]] Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(R_); }

  [[nodiscard]] SE3 inverse() const { return {R_.transpose(), -(R_.transpose() * t_)}; }
  [[nodiscard]] SE3 operator*(const SE3& other) const {
    return {R_ * other.R_, R_ * other.t_ + t_};
  }
  [[nodiscard]] Vec3 operator*(const Vec3& p) const { return R_ * p + t_; }

  /// Exponential of the twist (rho, omega), translation part first (Barfoot 2017, eq. 7.86).
  [[nodiscard]] static SE3 exp(const Vec6& twist);
  [[nodiscard]] Vec6 log() const;
  /// Adjoint: exp(Ad_T * xi) = T * exp(xi) * T^-1, twists with translation first.
  [[nodiscard]] Mat6 adjoint() const;

  /// The nearest rotation again, after many compositions.
  [[nodiscard]] SE3 normalized() const { return {Eigen::Quaterniond(R_).normalized(), t_}; }
  [[nodiscard]] bool is_finite() const { return R_.allFinite() && t_.allFinite(); }
  /// Rotation angle [rad], in [0, pi].
  [[nodiscard]] double angle() const;

 private:
  Mat3 R_;
  Vec3 t_;
};

/// Inverse of the left Jacobian of SE(3), twist (rho, omega), |omega| < 2 pi:
/// log(exp(d) * exp(twist)) = twist + se3_left_jacobian_inverse(twist) * d, to first order in d.
[[nodiscard]] Mat6 se3_left_jacobian_inverse(const Vec6& twist);

}  // namespace ygslam
