// What an IMU measured between two instants as one relative motion, from nothing but its samples
// and a guess of its biases: Forster, Carlone, Dellaert, Scaramuzza: On-Manifold Preintegration for
// Real-Time Visual-Inertial Odometry, T-RO 2017. Equation numbers are of that paper.
#pragma once

#include "geometry/imu.hpp"

namespace ygslam {

using Mat9 = Eigen::Matrix<double, 9, 9>;
using Mat96 = Eigen::Matrix<double, 9, 6>;

/// What an IMU's readings are off by.
struct ImuBias {
  Vec3 gyro_radps = Vec3::Zero();
  Vec3 accel_mps2 = Vec3::Zero();
};

/// Motion between two instants as seen from the first, gravity and the velocity there left out
/// (eq. 33): with R, v, p of the IMU in a frame where gravity is g,
///   R_j = R_i R,  v_j = v_i + g t + R_i v,  p_j = p_i + v_i t + g t^2/2 + R_i p.
struct MotionDelta {
  double duration_s = 0;
  Mat3 R = Mat3::Identity();
  Vec3 v = Vec3::Zero();  ///< [m/s]
  Vec3 p = Vec3::Zero();  ///< [m]

  /// This one, and then `next`.
  [[nodiscard]] MotionDelta then(const MotionDelta& next) const;
};

/// Errors of a delta are (rotation, v, p): R exp(rotation), v + dv, p + dp (eqs. 35 to 37).
class Preintegration {
 public:
  explicit Preintegration(const ImuBias& bias) : bias_(bias) {}

  /// White noise of the rates while they were integrated, as densities.
  struct Noise {
    double gyro_radps_sqrthz = 0;
    double accel_mps2_sqrthz = 0;
  };
  /// Rates as measured, in the middle of a step through which they change linearly.
  /// @param duration_s > 0.
  void add(const Vec3& angular_velocity_radps, const Vec3& specific_force_mps2, double duration_s,
           const Noise& noise);

  [[nodiscard]] double duration_s() const { return delta_.duration_s; }
  [[nodiscard]] const ImuBias& bias() const { return bias_; }  ///< that was assumed
  [[nodiscard]] const MotionDelta& delta() const { return delta_; }
  /// The delta had the bias been this one: to first order (eq. 44).
  [[nodiscard]] MotionDelta corrected(const ImuBias& bias) const;
  /// Of the errors, by white noise (eq. 63).
  [[nodiscard]] const Mat9& covariance() const { return covariance_; }
  /// Derivative of the errors by the biases, gyroscope first (appendix B).
  [[nodiscard]] const Mat96& bias_jacobian() const { return bias_jacobian_; }

 private:
  ImuBias bias_;
  MotionDelta delta_;
  Mat9 covariance_ = Mat9::Zero();
  Mat96 bias_jacobian_ = Mat96::Zero();
};

/// The reading at an instant between two samples.
[[nodiscard]] ImuSample interpolated(const ImuSample& before, const ImuSample& after, Timestamp at);

}  // namespace ygslam
