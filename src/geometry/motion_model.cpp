#include "geometry/motion_model.hpp"

namespace ygslam {
namespace {

// Of the change of velocity within a step that two steps show: all of it would double the noise.
constexpr double kTrustInAcceleration = 0.5;

}  // namespace

PredictedMotion MotionModel::predict(Timestamp now) const {
  const double dt_s = seconds_between(now, last_);
  const bool moves = velocity_per_s_ && dt_s > 0 && dt_s <= config_.max_gap_s;
  const SE3 T_now_last = moves ? SE3::exp(*velocity_per_s_ * dt_s) : SE3();
  return {T_now_last, body_velocity(now, T_now_last), velocity_gain_per_s(now)};
}

Vec6 MotionModel::body_velocity(Timestamp now, const SE3& T_now_last) const {
  const double gain_per_s = velocity_gain_per_s(now);
  const Vec6 twist = T_now_last.log();
  if (!velocity_per_s_ || gain_per_s == 0) return -gain_per_s * twist;
  const double dt_s = seconds_between(now, last_);
  return -(gain_per_s * twist - (gain_per_s * dt_s - 1) * *velocity_per_s_);
}

double MotionModel::velocity_gain_per_s(Timestamp now) const {
  const double dt_s = seconds_between(now, last_);
  if (dt_s <= 0 || dt_s > config_.max_gap_s) return 0;
  // A step gives the velocity in its middle; with the step before it goes on to its end.
  const double beyond = velocity_per_s_ ? kTrustInAcceleration * dt_s / (dt_s + last_step_s_) : 0;
  return (1 + beyond) / dt_s;
}

void MotionModel::update(Timestamp now, const SE3& T_now_last) {
  const double dt_s = seconds_between(now, last_);
  if (dt_s > 0 && dt_s <= config_.max_gap_s) {
    velocity_per_s_ = T_now_last.log() / dt_s;
    last_step_s_ = dt_s;
  } else {
    velocity_per_s_.reset();
  }
  last_ = now;
}

void MotionModel::reset(Timestamp now) {
  velocity_per_s_.reset();
  last_ = now;
}

}  // namespace ygslam
