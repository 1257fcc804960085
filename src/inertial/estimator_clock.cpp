#include <algorithm>
#include <cmath>

#include "inertial/inertial_estimator.hpp"

// How an InertialEstimator finds the offset of the IMU's clock, and notices a wrong one.
namespace ygslam {
namespace {

constexpr double kOffsetEvery_s = 1;
constexpr double kLongestTurn_s = 0.25;      // between two frames
constexpr double kMostOffsetSigma_s = 1e-3;  // of an offset that is believed
// Far away, and where a slow camera tells no better. Of 400 looks in 48 rendered runs
// (docs/inertial.md) none erred by more than 12 ms, which was four times its sigma.
constexpr double kMostFarSigma_s = 5e-3, kFarSigmaFactor = 2;
constexpr double kNewOffset_s = 2e-3;   // that one just taken may err by
constexpr double kBeginsAnew_s = 0.01;  // so far from the one before all begins anew
constexpr double kOtherOffsetSigmas = 3;
constexpr double kFarOffsetSigmas = 2;  // later looks tell the rest
constexpr double kLeastOffset_s = 4e-4;
constexpr double kUnknownOffset_s = 5e-3;  // of a clock of which nothing is known yet
constexpr double kOffsetMemory = 0.9;      // clocks drift
// That are looked for: where it is known, at first, and where nothing fits there.
constexpr double kNearOffset_s = 0.016, kFarOffset_s = 0.1, kFarthestOffset_s = 0.5;
constexpr double kLeastExplained = 0.5;  // of the seen rotation, by a gyroscope that is one
// Far away another swing of a hand fits somewhat, too.
constexpr double kLeastExplainedFar = 0.7;
constexpr double kSameFarOffset_s = 5e-3;  // of two looks in a row
constexpr int kMostUnfound = 3;            // looks at turns that should tell
constexpr double kWrongOffset_s = 0.02;    // of one that was told

bool is_believed(const std::optional<TimeOffset>& found) {
  return found && found->sigma_s <= kMostOffsetSigma_s && found->explained >= kLeastExplained;
}

bool is_believed_far(const std::optional<TimeOffset>& found) {
  return found && found->sigma_s <= kMostFarSigma_s && found->explained >= kLeastExplainedFar;
}

}  // namespace

/// A clock that jumped is looked for far around, by what is seen from now on.
void InertialEstimator::doubt_time_offset() {
  if (config_.time_offset_s || !offset_known_) return;
  offset_known_ = false;
  further_offset_s_ = offset_weight_ = 0;
  far_offset_s_.reset();
  offset_unfound_ = 0;
  turns_.clear();
}

void InertialEstimator::remember_turn(const SeenFrame& frame) {
  if (last_pose_ && seconds_between(frame.stamp, last_pose_->stamp) < kLongestTurn_s)
    turns_.push_back(
        {last_pose_->stamp, frame.stamp,
         so3_log(last_pose_->pose.T_odom_imu.R().transpose() * frame.pose.T_odom_imu.R())});
  last_pose_ = frame;
  while (!turns_.empty() && seconds_between(frame.stamp, turns_.front().from) > kTurnsKept_s)
    turns_.pop_front();
}

void InertialEstimator::find_time_offset(Timestamp now) {
  const bool is_told = config_.time_offset_s.has_value();
  const bool is_found = is_offset_precise() && !is_told;
  const double span_s = turns_.empty() ? 0 : seconds_between(now, turns_.front().from);
  // Each turn tells once; but a clock that jumped is noticed soon.
  const double every_s = is_found && offset_fitted_ ? kTurnsKept_s : kOffsetEvery_s;
  if (span_s < config_.start_s || seconds_between(now, offset_looked_at_) < every_s) return;
  offset_looked_at_ = now;
  const std::vector<SeenTurn> turns(turns_.begin(), turns_.end());
  const auto near =
      estimate_time_offset(turns, samples_.samples(), is_found ? kNearOffset_s : kFarOffset_s);
  const bool is_precise = is_believed(near);
  offset_fitted_ = is_precise && (!is_told || std::abs(near->offset_s) < kWrongOffset_s);
  if (!offset_fitted_) return find_far_offset(turns, is_precise ? near : std::nullopt);
  confirm_offset();
  offset_unfound_ = 0;
  if (!is_told) take_time_offset(*near);
}

void InertialEstimator::confirm_offset() {
  offset_fits_ = true;
  far_offset_s_.reset();
  offset_in_doubt_ = false;
}

void InertialEstimator::take_time_offset(const TimeOffset& found) {
  const double weight = 1 / (found.sigma_s * found.sigma_s);
  offset_weight_ = kOffsetMemory * offset_weight_ + weight;
  further_offset_s_ += weight / offset_weight_ * (found.offset_s - further_offset_s_);
  const double sigmas = std::abs(further_offset_s_) * std::sqrt(offset_weight_);
  if (sigmas > kOtherOffsetSigmas && std::abs(further_offset_s_) > kLeastOffset_s)
    set_further_offset(further_offset_s_);
  const bool is_rough = found.sigma_s > kMostOffsetSigma_s;
  if (is_rough && offset_weight_ == 0) offset_weight_ = weight;  // it is known no better
  offset_known_ = true;
}

/// @param near one that is believed, and that a told one contradicts.
void InertialEstimator::find_far_offset(std::span<const SeenTurn> turns,
                                        const std::optional<TimeOffset>& near) {
  const auto far = near ? near : estimate_time_offset(turns, samples_.samples(), kFarthestOffset_s);
  if (!is_believed_far(far)) {
    far_offset_s_.reset();
    const double explained = most_explained(turns, samples_.samples(), kFarthestOffset_s);
    offset_in_doubt_ = !offset_fits_ && explained < kLeastExplainedFar;
    offset_unfound_ = explained < kLeastExplained ? offset_unfound_ + 1 : 0;
    if (!offset_fits_ && offset_unfound_ >= kMostUnfound) restart(ImuFault::kOffset);
    return;
  }
  const double sigma_s = kFarSigmaFactor * far->sigma_s;
  const double used_to_s = config_.time_offset_s ? kWrongOffset_s : kNearOffset_s;
  offset_in_doubt_ = std::abs(far->offset_s) >= used_to_s + kOtherOffsetSigmas * sigma_s;
  if (offset_known_ && !offset_in_doubt_) {
    confirm_offset();
    if (!is_offset_precise()) take_time_offset({far->offset_s, sigma_s});
    return;
  }
  const bool again = far_offset_s_ && std::abs(far->offset_s - *far_offset_s_) < kSameFarOffset_s;
  far_offset_s_ = far->offset_s;
  if (!again) return;
  if (offset_known_) restart(config_.time_offset_s ? ImuFault::kToldOffset : ImuFault::kClock);
  config_.time_offset_s.reset();
  confirm_offset();
  if (std::abs(far->offset_s) > kFarOffsetSigmas * sigma_s) set_further_offset(far->offset_s);
  offset_weight_ = 1 / (sigma_s * sigma_s);
  offset_known_ = true;
}

bool InertialEstimator::is_offset_precise() const {
  return offset_known_ && (offset_weight_ == 0 || offset_sigma_s() <= kMostOffsetSigma_s);
}

double InertialEstimator::offset_sigma_s() const {
  if (config_.time_offset_s) return 0;
  if (!offset_known_) return kUnknownOffset_s;
  return offset_weight_ > 0 ? std::max(kLeastOffset_s, 1 / std::sqrt(offset_weight_))
                            : kNewOffset_s;
}

void InertialEstimator::set_further_offset(double offset_s) {
  const std::int64_t change_ns = to_ns(offset_s);
  offset_ns_ += change_ns;
  samples_.shift(-change_ns);
  further_offset_s_ = offset_weight_ = 0;
  if (std::abs(offset_s) > kBeginsAnew_s) restart(ImuFault::kNone);
}

/// As uncertain as it is when it was seen: what the camera moves in the time between.
SeenPose InertialEstimator::with_unsure_time(SeenPose seen, const InertialState& state,
                                             const Preintegration& measured) const {
  const double sigma_s = offset_sigma_s();
  const double moved_m = sigma_s * state.velocity_odom_mps.norm();
  const double turned_rad = sigma_s * so3_log(measured.delta().R).norm() / measured.duration_s();
  seen.covariance.diagonal().head<3>().array() += moved_m * moved_m;
  seen.covariance.diagonal().tail<3>().array() += turned_rad * turned_rad;
  return seen;
}

}  // namespace ygslam
