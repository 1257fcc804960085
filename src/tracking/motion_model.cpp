#include "tracking/motion_model.hpp"

namespace ygslam {

SE3 MotionModel::predict(Timestamp now) const {
  const double dt_s = seconds_between(now, last_);
  if (!velocity_per_s_ || dt_s <= 0 || dt_s > config_.max_gap_s) return {};
  return SE3::exp(*velocity_per_s_ * dt_s);
}

void MotionModel::update(Timestamp now, const SE3& T_now_last) {
  const double dt_s = seconds_between(now, last_);
  if (dt_s > 0 && dt_s <= config_.max_gap_s) {
    velocity_per_s_ = T_now_last.log() / dt_s;
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
