#include "system/inertial_stage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/counted.hpp"
#include "core/log.hpp"
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
/// What a bias is off by adds up over as many frames as the filter remembers: as noise of each it
/// counts so many times as much.
constexpr double kBiasMemory = 7;
/// Of the direction of gravity, which the same seconds of readings tell for neighbouring keyframes.
constexpr double kGravityMemory_s = 1.5;

VisualPose visual_pose(const TrackResult& result, const CorrelatedError& error) {
  const double factor = error.factor * (result.state == TrackState::kWeak ? kWeakStdFactor : 1);
  // exp(xi) on the left of T_camera_world is, to first order, -xi of the camera in its own axes.
  Mat6 covariance = factor * factor * result.covariance.value_or(Mat6::Zero());
  covariance.diagonal().head<3>().array() += error.min_std_m * error.min_std_m;
  covariance.diagonal().tail<3>().array() += error.min_std_rad * error.min_std_rad;
  return {result.T_odom_camera, covariance};
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
               .T_camera_imu = imu->T_camera_imu,
               .time_offset_s = imu->time_offset_s};
  reset();
}

void InertialStage::reset() {
  estimator_.reset();
  wheels_.reset();
  if (wheel_config_) wheels_.emplace(*wheel_config_);
  if (config_) estimator_.emplace(*config_, wheels_ ? &*wheels_ : nullptr);
  had_pose_ = overrules_ = wheels_agree_ = imu_was_told_of_ = false;
  believed_since_.reset();
  reading_times_.reset();
  frame_times_.reset();
  gravity_told_.reset();
  posed_.reset();
  held_.restart();
  wheels_told_.clear();
  imu_faults_.clear();
}

void InertialStage::add(const ImuSample& sample) {
  if (!estimator_) return;
  if (!reading_times_) reading_times_ = {sample.stamp, sample.stamp};
  reading_times_->add(sample.stamp);
  estimator_->add(sample);
}

void InertialStage::finish() {
  if (!estimator_ || !frame_times_ || std::exchange(imu_was_told_of_, true)) return;
  if (!reading_times_) {
    log::warn("IMU: no reading came: it was not used");
  } else if (reading_times_->last < frame_times_->first ||
             frame_times_->last < reading_times_->first) {
    log::warn("IMU: {}: it was not used", to_string(ImuFault::kOtherTime));
  } else {
    log::info("IMU: a second of poses is needed before it is of use, which never came");
  }
}

void InertialStage::add(const OdometrySample& sample) {
  if (wheels_) wheels_->add(sample);
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
  if (!frame_times_) frame_times_ = {stamp, stamp};
  frame_times_->add(stamp);
  const bool has_pose = is_seen(result.state) && result.T_odom_camera.is_finite();
  const bool found_again = has_pose && !had_pose_;
  had_pose_ = has_pose;
  const auto pose_with = [&](const CorrelatedError& error) {
    const bool is_known = result.covariance || result.matches == 0;  // or the origin itself
    return has_pose && is_known ? std::optional(visual_pose(result, error)) : std::nullopt;
  };
  if (wheels_) {
    hand_over(*wheels_, stamp, pose_with(kPerHalfSecond), found_again);
    tell_wheels();
  }
  if (estimator_) {
    overrule(stamp, result, found_again);
    hand_over(*estimator_, stamp, pose_with(kPerFrame), found_again);
    tell_imu(stamp, result);
    if (result.candidate) tell_gravity(*result.candidate);
  }
  const auto before = posed_;
  auto turn = turn_to(stamp, result.state);
  if (estimator_) hold(result, turn, before ? seconds_between(stamp, *before) : 0);
  return turn;
}

void InertialStage::hold(TrackResult& result, const std::optional<CameraTurn>& turn,
                         double step_s) {
  if (!is_seen(result.state) || !result.covariance || !result.T_odom_camera.is_finite())
    return held_.restart();
  std::optional<HeldTurn> held;
  const auto state = estimator_->state();
  if (turn && state) {
    const Mat3 R_camera_imu = config_->T_camera_imu.R();
    const double bias_std = std::sqrt(
        state->covariance.block<3, 3>(state_part::kGyroBias, state_part::kGyroBias).trace() / 3);
    held = {turn->turn_rad - step_s * (R_camera_imu * state->state.bias.gyro_radps),
            std::hypot(turn->std_rad, kBiasMemory * step_s * bias_std)};
  }
  const double factor = result.state == TrackState::kWeak ? kWeakStdFactor : 1;
  const SE3 T_points_held =
      held_.step(result.T_odom_camera, factor * factor * *result.covariance, held);
  result.T_odom_camera = result.T_odom_camera * T_points_held;
  result.T_world_camera = result.T_world_camera * T_points_held;
}

std::optional<CameraTurn> InertialStage::turn_to(Timestamp stamp, TrackState state) {
  if (!ygslam::has_pose(state)) return std::nullopt;
  const auto before = std::exchange(posed_, stamp);
  return estimator_ && before ? estimator_->turn(*before, stamp) : std::nullopt;
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

void InertialStage::tell_imu(Timestamp stamp, TrackResult& result) {
  const ImuFault fault = estimator_->take_fault();
  if (fault != ImuFault::kNone) {
    const std::size_t count = ++imu_faults_[fault];
    // The IMU is tried anew twice a second: not the second to the ninth time.
    if (count == 1 || (count >= 10 && is_worth_a_line(count)))
      log::warn("IMU: {}: it is not used until that has changed{}", to_string(fault),
                count > 1 ? fmt::format(" ({} times so far)", count) : "");
    if (is_wrong(fault) && believed_since_) result.imu_retraction = {*believed_since_};
    believed_since_.reset();
    imu_was_told_of_ = true;
  }
  if (believed_since_ || !estimator_->started()) return;
  believed_since_ = stamp;
  imu_was_told_of_ = true;
  const Vec3 up = -estimator_->gravity_odom()->normalized();
  log::info("IMU: gravity and biases are known; up in odom is {:.3f} {:.3f} {:.3f}", up.x(), up.y(),
            up.z());
}

void InertialStage::tell_wheels() {
  const WheelFault fault = wheels_->take_fault();
  if (fault != WheelFault::kNone && wheels_told_.insert(fault).second) {
    log::warn("wheels: {}: they are not used until that has changed", to_string(fault));
    wheels_agree_ = false;
  }
  if (wheels_agree_ || !wheels_->is_trusted()) return;
  wheels_agree_ = true;
  log::info(
      "wheels: they agree with the camera, their way times {:.4f} and their turn times {:.4f}",
      1 + wheels_->errors()[0], 1 + wheels_->errors()[1]);
}

}  // namespace ygslam
