#include "inertial/preintegration.hpp"

#include "geometry/so3_jacobian.hpp"

namespace ygslam {

MotionDelta MotionDelta::then(const MotionDelta& next) const {
  return {duration_s + next.duration_s, R * next.R, v + R * next.v,
          p + next.duration_s * v + R * next.p};
}

// Eqs. (35) to (37), with the rates of a step's middle taken at the attitude there: of second order
// where the paper's is of first.
void Preintegration::add(const Vec3& angular_velocity_radps, const Vec3& specific_force_mps2,
                         double duration_s, const Noise& noise) {
  const double dt = duration_s;
  const Vec3 half_angle = 0.5 * dt * (angular_velocity_radps - bias_.gyro_radps);
  const Vec3 force = specific_force_mps2 - bias_.accel_mps2;
  const Mat3 half = so3_exp(half_angle);
  const Mat3 R_middle = delta_.R * half;
  const Mat3 half_gain = 0.5 * dt * so3_left_jacobian(half_angle).transpose();
  const Mat3 full_gain = dt * so3_left_jacobian(2 * half_angle).transpose();
  const Mat3 lever = -R_middle * skew(force);  // of the acceleration by the attitude in the middle

  Mat9 by_state = Mat9::Identity();  // derivative of the errors after by those before ...
  by_state.block<3, 3>(0, 0) = (half * half).transpose();
  by_state.block<3, 3>(3, 0) = dt * lever * half.transpose();
  by_state.block<3, 3>(6, 0) = 0.5 * dt * dt * lever * half.transpose();
  by_state.block<3, 3>(6, 3) = dt * Mat3::Identity();
  Mat96 by_rates = Mat96::Zero();  // ... and by the rates
  by_rates.block<3, 3>(0, 0) = full_gain;
  by_rates.block<3, 3>(3, 0) = dt * lever * half_gain;
  by_rates.block<3, 3>(6, 0) = 0.5 * dt * dt * lever * half_gain;
  by_rates.block<3, 3>(3, 3) = dt * R_middle;
  by_rates.block<3, 3>(6, 3) = 0.5 * dt * dt * R_middle;

  const double gyro_variance = noise.gyro_radps_sqrthz * noise.gyro_radps_sqrthz / dt;
  const double accel_variance = noise.accel_mps2_sqrthz * noise.accel_mps2_sqrthz / dt;
  Vec6 variance;
  variance << Vec3::Constant(gyro_variance), Vec3::Constant(accel_variance);
  covariance_ = (by_state * covariance_ * by_state.transpose()).eval();
  covariance_ += by_rates * variance.asDiagonal() * by_rates.transpose();
  // White noise does not only come at a step's middle: what p has of its own is dt^3/12.
  covariance_.bottomRightCorner<3, 3>().diagonal().array() +=
      accel_variance * dt * dt * dt * dt / 12;
  bias_jacobian_ = (by_state * bias_jacobian_).eval() - by_rates;

  MotionDelta step{dt, half * half, dt * (half * force), 0.5 * dt * dt * (half * force)};
  delta_ = delta_.then(step);
}

MotionDelta Preintegration::corrected(const ImuBias& bias) const {
  Vec6 change;
  change << bias.gyro_radps - bias_.gyro_radps, bias.accel_mps2 - bias_.accel_mps2;
  const Eigen::Matrix<double, 9, 1> error = bias_jacobian_ * change;
  return {delta_.duration_s, delta_.R * so3_exp(error.head<3>()), delta_.v + error.segment<3>(3),
          delta_.p + error.tail<3>()};
}

ImuSample interpolated(const ImuSample& before, const ImuSample& after, Timestamp at) {
  const double span_s = seconds_between(after.stamp, before.stamp);
  const double share = span_s > 0 ? seconds_between(at, before.stamp) / span_s : 0;
  return {at,
          before.angular_velocity_radps +
              share * (after.angular_velocity_radps - before.angular_velocity_radps),
          before.specific_force_mps2 +
              share * (after.specific_force_mps2 - before.specific_force_mps2)};
}

}  // namespace ygslam
