#include "system/inertial_stage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "system/pose_covariance.hpp"
#include "tracking/inertial_verdict.hpp"

namespace ygslam {
namespace {

/// Errors of poses are correlated in time: those of a bent map for a second or two, those of few
/// points for a third of a second.
struct CorrelatedError {
  double min_std_m, min_std_rad;
  double factor = 1;  ///< of the standard deviation that a pose's points leave
};
// As white noise of each frame (docs/inertial.md; the factor: bench/coasting.py, white_wall), and
// half a second apart.
constexpr CorrelatedError kPerFrame{0.004, 0.0115, 3};
constexpr CorrelatedError kPerHalfSecond{0.002, 0.003};
/// Of the direction of gravity, which the same seconds of readings tell for neighbouring keyframes.
constexpr double kGravityMemory_s = 1.5;

VisualPose visual_pose(const TrackResult& result, const CorrelatedError& error,
                       const OdomDrift& drift) {
  const double factor = error.factor * (result.state == TrackState::kWeak ? kWeakStdFactor : 1);
  Mat6 covariance = factor * factor * result.covariance.value_or(Mat6::Zero());
  covariance.diagonal().head<3>().array() += error.min_std_m * error.min_std_m;
  covariance.diagonal().tail<3>().array() += error.min_std_rad * error.min_std_rad;
  return {result.T_odom_camera, covariance, drift};
}

OdomDrift drift_between(const Doubt& before, const Doubt& after) {
  return {std::max(0.0, after.position_m2 - before.position_m2),
          std::max(0.0, after.rotation_rad2 - before.rotation_rad2)};
}

template <typename Estimator>
void hand_over(Estimator& estimator, Timestamp stamp, const std::optional<VisualPose>& pose,
               bool found_again) {
  if (pose && found_again) {
    estimator.add_frame_found_again(stamp, *pose);
  } else {
    estimator.add_frame(stamp, pose);
  }
}

}  // namespace

InertialStage::InertialStage(const std::optional<ImuCalibration>& imu,
                             const std::optional<WheelCalibration>& wheels)
    : wheel_config_(wheels) {
  if (imu)
    config_ = {.noise = imu->noise,
               .range = {imu->gyro_range_radps, imu->accel_range_mps2},
               .T_camera_imu = imu->T_camera_imu,
               .time_offset_s = imu->time_offset_s};
  reset();
}

void InertialStage::reset() {
  estimator_.reset();
  wheels_.reset();
  if (wheel_config_) wheels_.emplace(*wheel_config_);
  if (config_) estimator_.emplace(*config_, wheels_ ? &*wheels_ : nullptr);
  held_.reset();
  if (config_) held_.emplace(config_->T_camera_imu);
  report_ = {};
  had_pose_ = overrules_ = false;
  last_doubt_ = {};
  believed_since_.reset();
  gravity_told_.reset();
}

void InertialStage::add(const ImuSample& sample) {
  if (!estimator_) return;
  report_.reading(sample.stamp);
  estimator_->add(sample);
}

void InertialStage::add(const OdometrySample& sample) {
  if (!wheels_) return;
  report_.wheel_pose();
  wheels_->add(sample);
}

/// The IMU's, held by the wheels where both are there; the wheels' alone where it says nothing, or
/// nothing that may stand for vision.
std::optional<PosePrediction> InertialStage::predict(Timestamp stamp) const {
  auto by_imu = estimator_ ? estimator_->predict(stamp) : std::nullopt;
  auto by_wheels = wheels_ && wheels_->is_trusted() ? wheels_->predict(stamp) : std::nullopt;
  if (!by_imu) return by_wheels;
  const bool wheels_know_better = !by_imu->trusted && by_wheels;
  return wheels_know_better ? by_wheels : by_imu;
}

std::optional<CameraTurn> InertialStage::take(Timestamp stamp, TrackResult& result) {
  if (!estimator_ && !wheels_) return std::nullopt;
  report_.frame(stamp);
  const bool has_pose = is_seen(result.state) && result.T_odom_camera.is_finite();
  const bool found_again = has_pose && !had_pose_;
  had_pose_ = has_pose;
  const bool is_known = has_pose && (result.covariance || result.matches == 0);  // or the origin
  const OdomDrift drift = drift_between(last_doubt_, result.doubt.odom);
  if (is_known) last_doubt_ = result.doubt.odom;
  const auto pose_with = [&](const CorrelatedError& error) {
    return is_known ? std::optional(visual_pose(result, error, drift)) : std::nullopt;
  };
  if (wheels_) {
    hand_over(*wheels_, stamp, pose_with(kPerHalfSecond), found_again);
    follow_wheels();
  }
  if (!estimator_) return std::nullopt;
  overrule(stamp, result, found_again);
  hand_over(*estimator_, stamp, pose_with(kPerFrame), found_again);
  follow_imu(stamp, result);
  if (result.candidate) tell_gravity(*result.candidate);
  return held_->take(stamp, *estimator_, result);
}

void InertialStage::tell_gravity(KeyframeCandidate& candidate) {
  const auto known = estimator_->camera_gravity();
  if (!known || known->stamp != candidate.frame->stamp) return;  // or its samples are late
  const double since_s =
      gravity_told_ ? seconds_between(known->stamp, *gravity_told_) : kGravityMemory_s;
  const double alike = std::max(1.0, kGravityMemory_s / since_s);
  candidate.gravity = {known->down_camera, alike * known->covariance};
  gravity_told_ = known->stamp;
  const GyroTurn& turn = estimator_->gyro_turn();
  if (turn.stamp == known->stamp)
    candidate.turn = {turn.series, turn.R_camera_start, turn.variance_rad2};
}

/// Where vision never came back to what the IMU says, the IMU was wrong.
void InertialStage::overrule(Timestamp stamp, const TrackResult& result, bool found_again) {
  if (result.went_along && !overrules_) estimator_->go_back(stamp);
  overrules_ |= result.overruled;
  if (!found_again || !std::exchange(overrules_, false)) return;
  const auto predicted = estimator_->predict(stamp);
  if (predicted && !while_certain(predicted)) estimator_->disagree();
}

void InertialStage::follow_imu(Timestamp stamp, TrackResult& result) {
  if (const ImuFault fault = estimator_->take_fault(); fault != ImuFault::kNone) {
    report_.imu_dropped(fault);
    if (is_wrong(fault) && believed_since_) result.imu_retraction = {*believed_since_};
    believed_since_.reset();
  }
  if (believed_since_ || !estimator_->started()) return;
  believed_since_ = stamp;
  report_.imu_began(*estimator_->gravity_odom());
}

void InertialStage::follow_wheels() {
  if (const WheelFault fault = wheels_->take_fault(); fault != WheelFault::kNone)
    report_.wheels_dropped(fault);
  if (wheels_->is_trusted()) report_.wheels_agree(*wheels_);
}

}  // namespace ygslam
