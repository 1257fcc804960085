#include "inertial/inertial_estimator.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "core/chi_square.hpp"

namespace ygslam {
namespace {

using namespace state_part;

constexpr double kLeastVariance = 1e-8;  // no pose is better than 0.1 mm, 0.1 mrad
constexpr double kLongestPause_s = 0.3;  // without a pose, before a start
constexpr std::size_t kFewestStartFrames = 10;
constexpr double kUnheard_s = 1.9;        // (2 s of frames) until it is told that it is useless ...
constexpr int kFewestUnheardFrames = 10;  // ... and after as many frames
constexpr double kMostWaiting_s = 0.3;    // of a frame, for its samples
constexpr double kShortestStep_s = 1e-3;  // frames nearer than that are one
constexpr double kPiece_s = 0.1;          // longer predictions are made of such
// Chi-square of a seen pose against the predicted one: 6 degrees of freedom, 99.9 %, and as vision
// is often more certain of itself than it should be, the same of twice its standard deviation.
constexpr double kDisagreement = 4 * kMostChiSquare6;
constexpr std::size_t kJudgedFrames = 20;
constexpr double kMostDisagreement = 0.5;  // of them
constexpr double kAgreed_s = 5;            // until the IMU may overrule vision
constexpr double kGoesBack_s = 0.5;
constexpr double kMostCarried_mps = 10;     // that images of an RGB-D camera can be followed at
constexpr double kMostCarriedGain_mps = 5;  // since it was last seen: a hand, a robot that brakes
constexpr double kTrustedStd_m = 0.1;       // after a second alone
constexpr double kWheelsSlip = kMostChiSquare6;
constexpr double kWheelsRest_s = 0.3;  // after they slipped

}  // namespace

InertialEstimator::InertialEstimator(const InertialConfig& config, const WheelOdometry* wheels)
    : config_(config),
      wheels_(wheels),
      T_imu_camera_(config.T_camera_imu.inverse()),
      samples_(config.noise, config.gyro_scale_error, config.range),
      offset_ns_(to_ns(config.time_offset_s.value_or(0))),
      offset_known_(config.time_offset_s.has_value()) {}

void InertialEstimator::add(const ImuSample& sample) {
  any_came_ = true;
  ImuSample shifted = sample;
  shifted.stamp.ns -= offset_ns_;
  if (samples_.add(shifted) == ImuBuffer::Verdict::kClockSetBack) restart(ImuFault::kClock);
  process_waiting();
}

SeenPose InertialEstimator::of_imu(const VisualPose& pose) const {
  const Mat6 adjoint = T_imu_camera_.adjoint();
  Mat6 covariance = adjoint * pose.covariance * adjoint.transpose();
  covariance.diagonal().array() += kLeastVariance;
  return {pose.T_odom_camera * config_.T_camera_imu, covariance, pose.drift};
}

void InertialEstimator::restart(ImuFault fault) {
  if (fault != ImuFault::kNone) note(fault);
  window_.reset();
  start_.clear();
  disagreed_.clear();
  earlier_.clear();
  agrees_since_.reset();
  seen_velocity_mps_.reset();
  slipped_at_.reset();
  tied_at_.reset();
  lasting_.setZero();
  turn_.restart();
  if (fault == ImuFault::kDisagrees || fault == ImuFault::kClock) doubt_time_offset();
}

void InertialEstimator::add_frame(Timestamp stamp, const std::optional<VisualPose>& pose) {
  put({stamp, pose, false});
}

void InertialEstimator::add_frame_found_again(Timestamp stamp, const VisualPose& pose) {
  put({stamp, pose, true});
}

void InertialEstimator::put(const Frame& frame) {
  if (last_frame_ && frame.stamp <= *last_frame_) return;
  CHECK(!frame.pose ||
        (frame.pose->T_odom_camera.is_finite() && frame.pose->covariance.allFinite()));
  last_frame_ = frame.stamp;
  if (frame.pose) last_seen_ = frame.stamp;
  if (frame.found_again) agrees_since_.reset();
  waiting_.push_back(frame);
  process_waiting();
  if (!heard_) look_for_readings(frame.stamp);
}

/// An IMU of which nothing was ever used is told once.
void InertialEstimator::look_for_readings(Timestamp now) {
  if (!first_frame_) first_frame_ = now;
  if (frames_without_ < kFewestUnheardFrames || seconds_between(now, *first_frame_) < kUnheard_s)
    return;
  heard_ = true;
  const ImuFault missing = samples_.why_missing(*first_frame_);
  fault_ = !any_came_                     ? ImuFault::kNoReadings
           : missing != ImuFault::kSilent ? missing
           : samples_.samples().empty()   ? ImuFault::kNoNumbers
                                          : ImuFault::kOtherTime;
}

void InertialEstimator::process_waiting() {
  while (!waiting_.empty()) {
    const Timestamp stamp = waiting_.front().stamp;
    const bool has_samples = !samples_.samples().empty() &&
                             samples_.samples().back().stamp >= stamp &&
                             (wheels_ == nullptr || wheels_->have_reached(stamp));
    if (!has_samples && seconds_between(*last_frame_, stamp) < kMostWaiting_s) return;
    const Frame frame = waiting_.front();
    waiting_.pop_front();
    process(frame);
  }
}

void InertialEstimator::process(const Frame& frame) {
  if (!heard_) {
    heard_ = samples_.between(frame.stamp, frame.stamp, {}).has_value();
    ++frames_without_;
  }
  std::optional<SeenPose> seen;
  if (frame.pose) seen = of_imu(*frame.pose);
  if (frame.found_again) last_pose_.reset();  // it did not turn there
  if (seen) remember_turn({frame.stamp, *seen});
  if (seen) find_time_offset(frame.stamp);
  if (window_) {
    go_on(frame.stamp, frame.found_again ? std::nullopt : seen);
    if (window_ && seen && frame.found_again) {
      window_->place_newest(*seen);
      seen_velocity_mps_ = window_->newest().state.velocity_odom_mps;
    }
    if (window_) remember(frame.stamp, seen.has_value());
    if (window_ && seen) once_trusted_ = once_trusted_ || is_trusted();
    if (seen) lasting_.setZero();
  } else if (seen) {
    if (frame.found_again) start_.clear();
    try_start({frame.stamp, *seen});
  }
  samples_.forget_before({frame.stamp.ns - to_ns(kTurnsKept_s + config_.start_s)});
}

void InertialEstimator::try_start(const SeenFrame& frame) {
  if (!start_.empty() && seconds_between(frame.stamp, start_.back().stamp) > kLongestPause_s)
    start_.clear();
  if (!start_.empty() && !samples_.between(start_.back().stamp, frame.stamp, {})) {
    if (!samples_.samples().empty() && last_seen_) note(samples_.why_missing(start_.back().stamp));
    start_.clear();
  }
  if (start_.empty() && !samples_.between(frame.stamp, frame.stamp, {})) return;
  start_.push_back(frame);
  if (start_.size() < kFewestStartFrames ||
      seconds_between(frame.stamp, start_.front().stamp) < config_.start_s)
    return;
  const auto integrate = [&](std::size_t i, const ImuBias& bias) {
    return *samples_.between(start_[i].stamp, start_[i + 1].stamp, bias);
  };
  auto started = start_window(start_, integrate, walk(), config_.bounds);
  if (auto* window = std::get_if<InertialWindow>(&started)) {
    window_ = std::move(*window);
    window_->marginalise_to(static_cast<std::size_t>(config_.window_frames));
    start_.clear();
    remember(frame.stamp, true);
    once_trusted_ = is_trusted();
  } else {
    const ImuFault fault = std::get<ImuFault>(started);
    note(fault);
    if (fault == ImuFault::kDisagrees) doubt_time_offset();
    start_.erase(start_.begin(), start_.begin() + std::ssize(start_) / 2);
  }
}

void InertialEstimator::go_on(Timestamp stamp, const std::optional<SeenPose>& seen) {
  const UncertainState last = window_->newest();
  if (seconds_between(stamp, last.state.stamp) < kShortestStep_s) return;
  const auto measured = samples_.between(last.state.stamp, stamp, last.state.bias);
  if (!measured) return restart(samples_.why_missing(last.state.stamp));
  MotionFactor motion(*measured, walk());
  if (seen)
    motion.add_drift(seen->drift, last.state, motion.after(last.state, stamp, window_->gravity()),
                     window_->gravity());
  const UncertainState predicted = last.moved(motion, stamp, window_->gravity());
  const auto dated =
      seen ? std::optional(with_unsure_time(*seen, predicted.state, *measured)) : std::nullopt;
  const auto wheels = seen ? std::nullopt : tie_by_wheels(last, predicted, motion);
  if (wheels) tied_at_ = stamp;
  if (wheels) lasting_ = wheels_->lasting_covariance(stamp);  // the gyroscope knows the turn
  turn_.add(stamp, *measured, config_.T_camera_imu);
  window_->add({predicted.state, std::move(motion), dated, wheels});
  if (!window_->solve(1)) return restart(ImuFault::kDisagrees);
  window_->marginalise_to(static_cast<std::size_t>(config_.window_frames));
  const ImuBias& bias = window_->nodes().back().state.bias;
  if (bias.gyro_radps.norm() > config_.bounds.most_gyro_bias_radps ||
      bias.accel_mps2.norm() > config_.bounds.most_accel_bias_mps2)
    return restart(ImuFault::kBias);
  if (is_absurd(window_->newest().state)) return restart(ImuFault::kDisagrees);
  if (seen) seen_velocity_mps_ = window_->newest().state.velocity_odom_mps;
  if (dated) judge(predicted, *dated);
}

/// Faster than a camera is carried: readings are wrong, vision's poses are metric.
bool InertialEstimator::is_absurd(const InertialState& state) const {
  const Vec3& velocity = state.velocity_odom_mps;
  return velocity.norm() > kMostCarried_mps ||
         (seen_velocity_mps_ && (velocity - *seen_velocity_mps_).norm() > kMostCarriedGain_mps);
}

void InertialEstimator::remember(Timestamp stamp, bool seen) {
  if (!agrees_since_) agrees_since_ = stamp;
  const Timestamp last_seen = seen ? stamp : earlier_.back().last_seen;
  earlier_.push_back({window_->newest(), last_seen});
  while (earlier_.size() > 1 && seconds_between(stamp, earlier_[1].stamp()) >= kGoesBack_s)
    earlier_.pop_front();
}

auto InertialEstimator::earlier(Timestamp now) const -> const Earlier* {
  const auto after = std::ranges::find_if(earlier_, [&](const Earlier& then) {
    return seconds_between(now, then.stamp()) < kGoesBack_s;
  });
  return after == earlier_.begin() ? nullptr : &*std::prev(after);
}

void InertialEstimator::go_back(Timestamp now) {
  const Earlier* found = window_ ? earlier(now) : nullptr;
  if (found == nullptr) return;
  const Earlier then = *found;
  std::erase_if(earlier_, [&](const Earlier& other) { return other.stamp() > then.stamp(); });
  std::erase_if(turns_, [&](const SeenTurn& turn) { return turn.to > then.stamp(); });
  last_pose_.reset();
  disagreed_.clear();
  for (Frame& frame : waiting_) frame = {frame.stamp, std::nullopt, false};
  // Else a short agreement would end here, and what took vision along would be believed.
  if (agrees_since_ && last_seen_) agrees_since_->ns -= last_seen_->ns - then.last_seen.ns;
  last_seen_ = then.last_seen;
  turn_.restart();
  InertialWindow window(window_->gravity());
  window.begin({then.state.state, std::nullopt, std::nullopt}, then.state.covariance.inverse());
  window_ = std::move(window);
  if (!window_->solve(1)) restart(ImuFault::kDisagrees);
}

/// @return nullopt where they slip, as the IMU feels it: gyroscope and accelerometer know better
/// what happens within a moment.
std::optional<WheelTie> InertialEstimator::tie_by_wheels(const UncertainState& before,
                                                         const UncertainState& predicted,
                                                         const MotionFactor& motion) {
  if (wheels_ == nullptr || !wheels_->is_trusted()) return std::nullopt;
  const auto told = wheels_->between(before.state.stamp, predicted.state.stamp);
  if (!told) return std::nullopt;
  const Mat6 adjoint = config_.T_camera_imu.inverse().adjoint();
  WheelTie tie{T_imu_camera_ * told->T_before_after * config_.T_camera_imu,
               adjoint * told->noise * adjoint.transpose()};
  tie.covariance.diagonal().array() += kLeastVariance;
  const double dt_s = seconds_between(predicted.state.stamp, before.state.stamp);
  const Mat3 R_imu_odom = before.state.T_odom_imu.R().transpose();
  Mat6 covariance = tie.covariance;
  const Mat6 lasting = told->by_errors * wheels_->error_covariance() * told->by_errors.transpose();
  covariance += adjoint * lasting * adjoint.transpose();
  covariance.topLeftCorner<3, 3>() += dt_s * dt_s * R_imu_odom *
                                          before.covariance.block<3, 3>(kVelocity, kVelocity) *
                                          R_imu_odom.transpose() +
                                      motion.covariance().block<3, 3>(kPosition, kPosition);
  covariance.bottomRightCorner<3, 3>() +=
      dt_s * dt_s * before.covariance.block<3, 3>(kGyroBias, kGyroBias) +
      motion.covariance().block<3, 3>(kRotation, kRotation);
  const Vec6 residual = linear(tie, before.state, predicted.state).residual;
  if (residual.dot(covariance.ldlt().solve(residual)) > kWheelsSlip)
    slipped_at_ = predicted.state.stamp;
  const bool rests =
      slipped_at_ && seconds_between(predicted.state.stamp, *slipped_at_) < kWheelsRest_s;
  return rests ? std::nullopt : std::optional(tie);
}

void InertialEstimator::judge(const UncertainState& predicted, const SeenPose& seen) {
  const auto [residual, by_pose] = linear(seen, predicted.state);
  const Mat6 covariance =
      by_pose * predicted.covariance.topLeftCorner<6, 6>() * by_pose.transpose() + seen.covariance;
  disagreed_.push_back(residual.dot(covariance.ldlt().solve(residual)) > kDisagreement);
  if (disagreed_.back()) agrees_since_.reset();
  if (disagreed_.size() > kJudgedFrames) disagreed_.pop_front();
  const auto count = std::count(disagreed_.begin(), disagreed_.end(), true);
  if (static_cast<double>(count) > kMostDisagreement * kJudgedFrames) restart(ImuFault::kDisagrees);
}

std::optional<UncertainState> InertialEstimator::moved(UncertainState now, Timestamp stamp) const {
  while (now.state.stamp < stamp) {
    const Timestamp next{std::min(stamp.ns, now.state.stamp.ns + to_ns(kPiece_s))};
    const auto measured = samples_.between(now.state.stamp, next, now.state.bias);
    if (!measured) return std::nullopt;
    now = now.moved(MotionFactor(*measured, walk()), next, window_->gravity());
  }
  return now;
}

PosePrediction::Earlier InertialEstimator::of_camera(const UncertainState& state) const {
  // Of the state's errors, those of T_odom_imu exp(error); from there to the camera's.
  Mat6 by_state = Mat6::Zero();
  by_state.block<3, 3>(0, kPosition) = state.state.T_odom_imu.R().transpose();
  by_state.block<3, 3>(3, kRotation).setIdentity();
  const Mat6 to_camera = config_.T_camera_imu.adjoint() * by_state;
  return {state.state.T_odom_imu * T_imu_camera_,
          to_camera * state.covariance.topLeftCorner<6, 6>() * to_camera.transpose()};
}

std::optional<PosePrediction> InertialEstimator::predict(Timestamp stamp) const {
  if (!window_ || stamp < *last_frame_) return std::nullopt;
  const auto now = moved(window_->newest(), stamp);
  const auto reading = samples_.reading(stamp);
  if (!now || !reading || is_absurd(now->state)) return std::nullopt;
  const auto [T_odom_camera, covariance] = of_camera(*now);
  PosePrediction result{.T_odom_camera = T_odom_camera,
                        .covariance = covariance,
                        .trusted = once_trusted_ && !offset_in_doubt_};
  const Vec3 rate = reading->angular_velocity_radps - now->state.bias.gyro_radps;
  Vec6 imu_velocity;
  imu_velocity << now->state.T_odom_imu.R().transpose() * now->state.velocity_odom_mps, rate;
  result.body_velocity = config_.T_camera_imu.adjoint() * imu_velocity;
  if (last_seen_) result.unseen_s = seconds_between(stamp, *last_seen_);
  result.by_wheels = tied_at_ && seconds_between(stamp, *tied_at_) < 2 * kWheelsRest_s;
  result.covariance += lasting_;
  const bool offset_is_doubtful =
      offset_in_doubt_ || (!offset_known_ && (offset_unfound_ > 0 || far_offset_s_));
  result.agreed = !offset_is_doubtful && agrees_since_ && last_seen_ &&
                  seconds_between(*last_seen_, *agrees_since_) > kAgreed_s;
  if (const Earlier* then = result.agreed ? earlier(stamp) : nullptr)
    if (const auto since = moved(then->state, stamp)) result.earlier = of_camera(*since);
  return result;
}

bool InertialEstimator::is_trusted() const {
  if (!window_) return false;
  const auto [state, covariance] = window_->newest();
  const Mat3 R = state.T_odom_imu.R();
  const Vec3 g = window_->gravity().at(state.tilt);
  // A second at rest: dp = v + (R [R^T g] dphi - R dba + dg) / 2 + ... / 6 of the gyroscope's bias.
  Eigen::Matrix<double, 3, kStateSize> J = Eigen::Matrix<double, 3, kStateSize>::Zero();
  const Mat3 by_turn = R * skew(R.transpose() * g);
  J.block<3, 3>(0, kRotation) = 0.5 * by_turn;
  J.block<3, 3>(0, kVelocity).setIdentity();
  J.block<3, 3>(0, kGyroBias) = -by_turn / 6;
  J.block<3, 3>(0, kAccelBias) = -0.5 * R;
  J.block<3, 2>(0, kTilt) = 0.5 * window_->gravity().derivative(state.tilt);
  const Mat3 drift = J * covariance * J.transpose();
  return drift.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff() <
         kTrustedStd_m * kTrustedStd_m;
}

std::optional<UncertainState> InertialEstimator::state() const {
  return window_ ? std::optional(window_->newest()) : std::nullopt;
}

std::optional<Vec3> InertialEstimator::gravity_odom() const {
  if (!window_) return std::nullopt;
  return window_->gravity().at(window_->nodes().back().state.tilt);
}

}  // namespace ygslam
