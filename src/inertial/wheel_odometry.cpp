#include "inertial/wheel_odometry.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/chi_square.hpp"

namespace ygslam {
namespace {

constexpr int kWheelClockIsSetBack = 10;  // samples in a row
constexpr double kMostStep_s = 0.3;       // between two samples
constexpr double kFirstPose_s = 2;        // after the first frame at the latest
constexpr double kMostBeyond_s = 0.1;     // that a prediction goes past the newest sample
constexpr double kMostSpeed_mps = 10,
                 kMostTurn_radps = 10;  // faster: the robot began to count anew
constexpr double kKept_s = 2;           // of samples before a frame
constexpr double kComparedEvery_s = 0.5;
constexpr double kLongestComparison_s = 1.0;
// Chi-square of 6 degrees of freedom, 99.9 %, at twice the standard deviation.
constexpr double kWheelDisagreement = 4 * kMostChiSquare6;
constexpr double kSlipForgotten_s = 1.0;
constexpr int kSlipsOfOthers = 12;  // in a row: no slip, another robot
constexpr double kEnoughAgreed_m = 0.2;
constexpr double kMostSigmas = 4;  // of a calibration's errors: more is another robot's, or clock
// What a calibration leaves, and what vision cannot tell better: its own errors last, too.
const WheelErrors kFirstStd = (WheelErrors() << 0.02, 0.03, 0.02, 0.02, 0.02).finished();
const WheelErrors kLeastStd = (WheelErrors() << 0.002, 0.003, 0.002, 0.002, 0.002).finished();

WheelErrorMatrix variances(const WheelErrors& std) {
  return std.cwiseAbs2().asDiagonal().toDenseMatrix();
}

}  // namespace

const char* to_string(WheelFault fault) {
  switch (fault) {
    case WheelFault::kNone:
      return "none";
    case WheelFault::kSilent:
      return "no poses come";
    case WheelFault::kJumped:
      return "their poses jump";
    case WheelFault::kClock:
      return "stamps went back";
    case WheelFault::kDisagrees:
      return "they tell another way than the camera sees (units, axes, clock, T_base_camera?)";
    case WheelFault::kNoPoses:
      return "no valid pose came in the first 2 s";
  }
  return "?";
}

WheelOdometry::WheelOdometry(const WheelCalibration& wheels)
    : wheels_(wheels), covariance_(variances(kFirstStd)) {}

void WheelOdometry::restart(WheelFault fault) {
  if (fault_ == WheelFault::kNone) fault_ = fault;
  samples_.clear();
  waiting_.clear();
  compared_.reset();
}

void WheelOdometry::add(const OdometrySample& sample) {
  if (!sample.T_odom_base.is_finite()) return;
  OdometrySample shifted = sample;
  shifted.stamp.ns -= to_ns(wheels_.time_offset_s);
  if (!samples_.empty()) {
    const double step_s = seconds_between(shifted.stamp, samples_.back().stamp);
    if (step_s <= 0) {
      if (++gone_back_ < kWheelClockIsSetBack) return;
      restart(WheelFault::kClock);
    } else {
      const Vec6 step = (samples_.back().T_odom_base.inverse() * shifted.T_odom_base).log();
      const bool is_driven = step.head<3>().norm() <= kMostSpeed_mps * step_s &&
                             step.tail<3>().norm() <= kMostTurn_radps * step_s;
      if (step_s > kMostStep_s) {
        restart(WheelFault::kSilent);
      } else if (!is_driven) {
        restart(WheelFault::kJumped);
      }
    }
  }
  gone_back_ = 0;
  has_begun_ = true;
  samples_.push_back(shifted);
}

/// @param beyond_s how far past the newest sample its velocity goes on.
std::optional<OdometrySample> WheelOdometry::at(Timestamp stamp, double beyond_s) const {
  if (samples_.size() < 2 || stamp < samples_.front().stamp) return std::nullopt;
  if (seconds_between(stamp, samples_.back().stamp) > beyond_s) return std::nullopt;
  auto after = std::ranges::upper_bound(samples_, stamp, {}, &OdometrySample::stamp);
  if (after == samples_.end()) --after;
  const OdometrySample& before = *std::prev(after);
  const double share =
      seconds_between(stamp, before.stamp) / seconds_between(after->stamp, before.stamp);
  const Vec6 step = (before.T_odom_base.inverse() * after->T_odom_base).log();
  return OdometrySample{stamp, before.T_odom_base * SE3::exp(share * step)};
}

std::optional<WheelSum> WheelOdometry::summed(Timestamp from, Timestamp to, double beyond_s) const {
  const auto first = at(from, beyond_s), last = at(to, beyond_s);
  if (!first || !last) return std::nullopt;
  WheelSum sum(wheels_);
  OdometrySample before = *first;
  const auto step_to = [&](const OdometrySample& sample) {
    sum.add(before.T_odom_base.inverse() * sample.T_odom_base,
            seconds_between(sample.stamp, before.stamp), errors_);
    before = sample;
  };
  for (auto next = std::ranges::upper_bound(samples_, from, {}, &OdometrySample::stamp);
       next != samples_.end() && next->stamp < to; ++next)
    step_to(*next);
  step_to(*last);
  return sum;
}

std::optional<WheelMotion> WheelOdometry::between(Timestamp from, Timestamp to) const {
  const auto sum = summed(from, to, 0);
  return sum ? std::optional(sum->of_camera(errors_)) : std::nullopt;
}

bool WheelOdometry::have_reached(Timestamp stamp) const {
  return samples_.empty() || samples_.back().stamp >= stamp ||
         seconds_between(stamp, samples_.back().stamp) > kMostStep_s;
}

bool WheelOdometry::is_trusted() const { return agreed_m_ >= kEnoughAgreed_m && !slipped_at_; }

void WheelOdometry::add_frame(Timestamp stamp, const std::optional<VisualPose>& pose) {
  if (!first_frame_) first_frame_ = stamp;
  if (!has_begun_ && seconds_between(stamp, *first_frame_) > kFirstPose_s) {
    has_begun_ = true;
    fault_ = WheelFault::kNoPoses;
  }
  if (!samples_.empty() && seconds_between(stamp, samples_.back().stamp) > kMostStep_s)
    restart(WheelFault::kSilent);
  if (!pose) {
    waiting_.clear();
    compared_.reset();
    if (last_seen_ && seconds_between(stamp, last_seen_->stamp) > kLongestByWheels_s)
      last_seen_.reset();
    forget_before(last_seen_ ? last_seen_->stamp : stamp);
    return;
  }
  last_seen_ = Seen{stamp, *pose};
  if (!samples_.empty()) waiting_.push_back(*last_seen_);
  while (!waiting_.empty() && !samples_.empty() &&
         waiting_.front().stamp <= samples_.back().stamp) {
    compare(waiting_.front());
    waiting_.pop_front();
  }
  forget_before(stamp);
}

void WheelOdometry::forget_before(Timestamp frame) {
  const Timestamp kept{frame.ns - to_ns(kKept_s)};
  while (samples_.size() > 2 && samples_[1].stamp < kept) samples_.pop_front();
}

void WheelOdometry::add_frame_found_again(Timestamp stamp, const VisualPose& pose) {
  waiting_.clear();
  compared_.reset();  // it did not go there
  add_frame(stamp, pose);
}

void WheelOdometry::note_slip(Timestamp stamp) {
  slips_ += slipped_at_ ? 0 : 1;
  slipped_at_ = stamp;
  if (++slips_in_row_ < kSlipsOfOthers) return;
  fault_ = WheelFault::kDisagrees;
  slips_in_row_ = 0;
  agreed_m_ = 0;
}

/// Whether they slip is looked at in every frame, what they err for long twice a second.
void WheelOdometry::compare(const Seen& seen) {
  if (!compared_ || seconds_between(seen.stamp, compared_->stamp) > kLongestComparison_s) {
    compared_ = seen;
    return;
  }
  const auto sum = summed(compared_->stamp, seen.stamp, 0);
  if (!sum) {
    compared_ = seen;
    return;
  }
  const WheelMotion motion = sum->of_camera(errors_);
  const SE3 T_before_seen = compared_->pose.T_odom_camera.inverse() * seen.pose.T_odom_camera;
  const Vec6 error = (motion.T_before_after.inverse() * T_before_seen).log();
  const Mat6 adjoint = T_before_seen.inverse().adjoint();
  const Mat6 noise = adjoint * compared_->pose.covariance * adjoint.transpose() +
                     seen.pose.covariance + motion.noise;
  const Mat6 covariance = noise + motion.by_errors * covariance_ * motion.by_errors.transpose();
  const bool slips = !(error.dot(covariance.ldlt().solve(error)) <= kWheelDisagreement);
  if (!slips && seconds_between(seen.stamp, compared_->stamp) < kComparedEvery_s) return;
  compared_ = seen;
  if (slips) return note_slip(seen.stamp);
  slips_in_row_ = 0;
  if (slipped_at_ && seconds_between(seen.stamp, *slipped_at_) > kSlipForgotten_s)
    slipped_at_.reset();
  agreed_m_ += sum->way_m();
  learn(motion, error, noise);
}

/// Kalman's update. Where the robot rests nothing is learned: by_errors is 0.
void WheelOdometry::learn(const WheelMotion& motion, const Vec6& error, const Mat6& noise) {
  const ByWheelErrors& J = motion.by_errors;
  const Mat6 innovation = J * covariance_ * J.transpose() + noise;
  const Eigen::Matrix<double, kWheelErrors, 6> gain =
      innovation.ldlt().solve(J * covariance_).transpose();
  errors_ += gain * error;
  covariance_ = ((WheelErrorMatrix::Identity() - gain * J) * covariance_).eval();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  for (int i = 0; i < kWheelErrors; ++i)
    covariance_(i, i) = std::max(covariance_(i, i), kLeastStd[i] * kLeastStd[i]);
  if ((errors_.cwiseAbs().array() <= kMostSigmas * kFirstStd.array()).all()) return;
  fault_ = WheelFault::kDisagrees;
  errors_.setZero();
  covariance_ = variances(kFirstStd);
  agreed_m_ = 0;
}

std::optional<WheelSum> WheelOdometry::since_seen(Timestamp stamp) const {
  return last_seen_ ? summed(last_seen_->stamp, stamp, kMostBeyond_s) : std::nullopt;
}

Mat6 WheelOdometry::lasting_covariance(Timestamp stamp) const {
  const auto sum = since_seen(stamp);
  if (!sum) return Mat6::Zero();
  ByWheelErrors J = sum->of_camera(errors_).by_errors;
  J.col(1).setZero();
  return J * covariance_ * J.transpose();
}

std::optional<PosePrediction> WheelOdometry::predict(Timestamp stamp) const {
  const auto sum = since_seen(stamp);
  if (!sum) return std::nullopt;
  const WheelMotion motion = sum->of_camera(errors_);
  PosePrediction result{.T_odom_camera = last_seen_->pose.T_odom_camera * motion.T_before_after,
                        .unseen_s = seconds_between(stamp, last_seen_->stamp),
                        .trusted = is_trusted(),
                        .by_wheels = true};
  const Mat6 adjoint = motion.T_before_after.inverse().adjoint();
  result.covariance =
      adjoint * last_seen_->pose.covariance * adjoint.transpose() + motion.covariance(covariance_);
  constexpr double kVelocityOver_s = 0.1;
  const Timestamp until = std::min(stamp, samples_.back().stamp);
  if (const auto newest = between({until.ns - to_ns(kVelocityOver_s)}, until))
    result.body_velocity = newest->T_before_after.log() / kVelocityOver_s;
  return result;
}

}  // namespace ygslam
