#include "inertial/inertial_state.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <utility>

#include "geometry/so3_jacobian.hpp"

namespace ygslam {
namespace {

using namespace state_part;

Mat3 right_jacobian(const Vec3& omega) { return so3_left_jacobian(omega).transpose(); }

}  // namespace

TiltedGravity::TiltedGravity(const Vec3& down_odom)
    : middle_(kStandardGravity_mps2 * down_odom.normalized()) {
  const Vec3 down = down_odom.normalized();
  const Vec3 first = down.unitOrthogonal();
  basis_ << first, down.cross(first);
}

Vec3 TiltedGravity::at(const Vec2& tilt) const { return so3_exp(basis_ * tilt) * middle_; }

Eigen::Matrix<double, 3, 2> TiltedGravity::derivative(const Vec2& tilt) const {
  const Vec3 turn = basis_ * tilt;
  return -so3_exp(turn) * skew(middle_) * right_jacobian(turn) * basis_;
}

Eigen::Matrix<double, 2, 3> TiltedGravity::tilt_from_gravity(const Vec2& tilt) const {
  const Eigen::Matrix<double, 3, 2> by_tilt = derivative(tilt);
  return (by_tilt.transpose() * by_tilt).inverse() * by_tilt.transpose();
}

InertialState changed(const InertialState& state, const StateVector& change) {
  InertialState result = state;
  result.T_odom_imu = {state.T_odom_imu.R() * so3_exp(change.segment<3>(kRotation)),
                       state.T_odom_imu.t() + change.segment<3>(kPosition)};
  result.velocity_odom_mps += change.segment<3>(kVelocity);
  result.bias.gyro_radps += change.segment<3>(kGyroBias);
  result.bias.accel_mps2 += change.segment<3>(kAccelBias);
  result.tilt += change.segment<2>(kTilt);
  return result;
}

StateVector change_between(const InertialState& from, const InertialState& to) {
  StateVector change;
  change << so3_log(from.T_odom_imu.R().transpose() * to.T_odom_imu.R()),
      to.T_odom_imu.t() - from.T_odom_imu.t(), to.velocity_odom_mps - from.velocity_odom_mps,
      to.bias.gyro_radps - from.bias.gyro_radps, to.bias.accel_mps2 - from.bias.accel_mps2,
      to.tilt - from.tilt;
  return change;
}

StateMatrix change_jacobian(const InertialState& from, const InertialState& to) {
  StateMatrix J = StateMatrix::Identity();
  const Vec3 turn = so3_log(from.T_odom_imu.R().transpose() * to.T_odom_imu.R());
  J.block<3, 3>(kRotation, kRotation) = right_jacobian(turn).inverse();
  return J;
}

MotionFactor::MotionFactor(Preintegration measured, const StateWalk& walk)
    : measured_(std::move(measured)), covariance_(StateMatrix::Zero()) {
  const double dt = measured_.duration_s();
  const auto variance = [&](double density) { return density * density * dt; };
  covariance_.topLeftCorner<9, 9>() = measured_.covariance();
  covariance_.diagonal().segment<3>(kGyroBias).setConstant(variance(walk.gyro_radps2_sqrthz));
  covariance_.diagonal().segment<3>(kAccelBias).setConstant(variance(walk.accel_mps3_sqrthz));
  covariance_.diagonal().segment<2>(kTilt).setConstant(variance(walk.tilt_rad_sqrts));
  information_ = covariance_.diagonal().cwiseInverse().asDiagonal();
  const Eigen::LLT<Mat9> root(measured_.covariance());
  information_.topLeftCorner<9, 9>() = root.solve(Mat9::Identity());
}

// In the rows of linear().
void MotionFactor::add_drift(const OdomDrift& drift, const InertialState& before,
                             const InertialState& after, const TiltedGravity& gravity) {
  if (drift.position_m2 <= 0 && drift.rotation_rad2 <= 0) return;
  const Mat3& R_odom_after = after.T_odom_imu.R();
  const Mat3 R_before_after = before.T_odom_imu.R().transpose() * R_odom_after;
  Eigen::Matrix<double, kStateSize, 3> by_turn = Eigen::Matrix<double, kStateSize, 3>::Zero();
  by_turn.middleRows<3>(0).setIdentity();
  by_turn.middleRows<3>(3) =
      -R_before_after * skew(R_odom_after.transpose() * after.velocity_odom_mps);
  by_turn.bottomRows<2>() = -gravity.tilt_from_gravity(after.tilt) * R_odom_after *
                            skew(R_odom_after.transpose() * gravity.at(after.tilt));
  covariance_ += drift.rotation_rad2 * by_turn * by_turn.transpose();
  covariance_.diagonal().segment<3>(6).array() += drift.position_m2;
  information_ = covariance_.llt().solve(StateMatrix::Identity());
}

// Rows: rotation, velocity, position, biases, tilt. Where the measured velocity stands, position's
// changes have their place, and the other way round: the paper's order is that of Preintegration.
MotionFactor::Linear MotionFactor::linear(const InertialState& before, const InertialState& after,
                                          const TiltedGravity& gravity) const {
  const double dt = measured_.duration_s();
  const MotionDelta delta = measured_.corrected(before.bias);
  const Mat3 R_imu_odom = before.T_odom_imu.R().transpose();
  const Vec3 g = gravity.at(before.tilt);
  const Vec3 v = R_imu_odom * (after.velocity_odom_mps - before.velocity_odom_mps - dt * g);
  const Vec3 p = R_imu_odom * (after.T_odom_imu.t() - before.T_odom_imu.t() -
                               dt * before.velocity_odom_mps - 0.5 * dt * dt * g);
  const Mat3 R_before_after = R_imu_odom * after.T_odom_imu.R();
  const Vec3 turn = so3_log(delta.R.transpose() * R_before_after);
  const Mat3 turn_gain = right_jacobian(turn).inverse();
  const Mat96& by_bias = measured_.bias_jacobian();
  const Vec3 bias_turn =
      by_bias.topLeftCorner<3, 3>() * (before.bias.gyro_radps - measured_.bias().gyro_radps);
  const Eigen::Matrix<double, 3, 2> by_tilt = R_imu_odom * gravity.derivative(before.tilt);

  Linear result{StateVector::Zero(), StateMatrix::Zero(), StateMatrix::Zero()};
  result.residual << turn, v - delta.v, p - delta.p, after.bias.gyro_radps - before.bias.gyro_radps,
      after.bias.accel_mps2 - before.bias.accel_mps2, after.tilt - before.tilt;

  StateMatrix& B = result.by_before;
  B.block<3, 3>(0, kRotation) = -turn_gain * R_before_after.transpose();
  B.block<3, 3>(0, kGyroBias) = -turn_gain * so3_exp(turn).transpose() * right_jacobian(bias_turn) *
                                by_bias.topLeftCorner<3, 3>();
  B.block<3, 3>(3, kRotation) = skew(v);
  B.block<3, 3>(3, kVelocity) = -R_imu_odom;
  B.block<3, 6>(3, kGyroBias) = -by_bias.middleRows<3>(3);
  B.block<3, 2>(3, kTilt) = -dt * by_tilt;
  B.block<3, 3>(6, kRotation) = skew(p);
  B.block<3, 3>(6, kPosition) = -R_imu_odom;
  B.block<3, 3>(6, kVelocity) = -dt * R_imu_odom;
  B.block<3, 6>(6, kGyroBias) = -by_bias.bottomRows<3>();
  B.block<3, 2>(6, kTilt) = -0.5 * dt * dt * by_tilt;
  B.bottomRightCorner<8, 8>() = -Eigen::Matrix<double, 8, 8>::Identity();

  StateMatrix& A = result.by_after;
  A.block<3, 3>(0, kRotation) = turn_gain;
  A.block<3, 3>(3, kVelocity) = R_imu_odom;
  A.block<3, 3>(6, kPosition) = R_imu_odom;
  A.bottomRightCorner<8, 8>().setIdentity();
  return result;
}

InertialState MotionFactor::after(const InertialState& before, Timestamp stamp,
                                  const TiltedGravity& gravity) const {
  const double dt = measured_.duration_s();
  const MotionDelta delta = measured_.corrected(before.bias);
  const Vec3 g = gravity.at(before.tilt);
  const SE3& T = before.T_odom_imu;
  InertialState result = before;
  result.stamp = stamp;
  result.T_odom_imu = SE3(T.R() * delta.R, T.t() + dt * before.velocity_odom_mps +
                                               0.5 * dt * dt * g + T.R() * delta.p)
                          .normalized();
  result.velocity_odom_mps += dt * g + T.R() * delta.v;
  return result;
}

UncertainState UncertainState::moved(const MotionFactor& motion, Timestamp stamp,
                                     const TiltedGravity& gravity) const {
  UncertainState result{motion.after(state, stamp, gravity), {}};
  const auto [residual, by_before, by_after] = motion.linear(state, result.state, gravity);
  const StateMatrix back = by_after.inverse();
  const StateMatrix forward = back * by_before;
  result.covariance = forward * covariance * forward.transpose();
  result.covariance += back * motion.covariance() * back.transpose();
  return result;
}

SeenLinear linear(const SeenPose& seen, const InertialState& state) {
  const Mat3 R_seen_odom = seen.T_odom_imu.R().transpose();
  const Vec3 turn = so3_log(R_seen_odom * state.T_odom_imu.R());
  SeenLinear result{{}, Mat6::Zero()};
  result.residual << R_seen_odom * (state.T_odom_imu.t() - seen.T_odom_imu.t()), turn;
  result.by_pose.block<3, 3>(0, kPosition) = R_seen_odom;
  result.by_pose.block<3, 3>(3, kRotation) = right_jacobian(turn).inverse();
  return result;
}

WheelLinear linear(const WheelTie& tie, const InertialState& before, const InertialState& after) {
  const SE3 T_before_after = before.T_odom_imu.inverse() * after.T_odom_imu;
  const SE3 T_told_after = tie.T_before_after.inverse() * T_before_after;
  const Vec3 turn = so3_log(T_told_after.R());
  const Mat3 by_turn = right_jacobian(turn).inverse();
  const Mat3 R_told_odom = (before.T_odom_imu.R() * tie.T_before_after.R()).transpose();
  WheelLinear result{{}, Mat6::Zero(), Mat6::Zero()};
  result.residual << T_told_after.t(), turn;
  result.by_after.block<3, 3>(0, kPosition) = R_told_odom;
  result.by_after.block<3, 3>(3, kRotation) = by_turn;
  result.by_before.block<3, 3>(0, kPosition) = -R_told_odom;
  result.by_before.block<3, 3>(0, kRotation) =
      tie.T_before_after.R().transpose() * skew(T_before_after.t());
  result.by_before.block<3, 3>(3, kRotation) = -by_turn * T_before_after.R().transpose();
  return result;
}

}  // namespace ygslam
