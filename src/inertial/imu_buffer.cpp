#include "inertial/imu_buffer.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

constexpr int kClockIsSetBack = 20;     // samples in a row
constexpr int kIsAhead = 5;             // the same, after a pause or where the clock was set
constexpr double kFarAhead_s = 1;       // of the one before
constexpr double kMostGap_s = 0.15;     // without a sample
constexpr double kGapPeriods = 2.5;     // a longer step has samples missing
constexpr double kMostWait_s = 0.1;     // that the newest sample may be older than a frame
constexpr double kGapGyro_radps = 1;    // how wrong a rate between two samples may be ...
constexpr double kGapAccel_mps2 = 5;    // ... where others are missing
constexpr double kHandGyro_radps2 = 5;  // how fast rates change in a hand
constexpr double kHandAccel_mps3 = 50;
constexpr double kTurnsOneWay_s = 0.3;  // how long a scale's error adds up
constexpr double kClippedGyro_radps = 10;
constexpr double kClippedAccel_mps2 = 50;
// Sensors clip at 125 deg/s or 2 g at the least, and noise makes equal readings rare above that.
constexpr double kLeastGyroRange_radps = 2.1, kLeastAccelRange_mps2 = 19;
constexpr int kEqualWhereClipped = 3;

// Whatever the unit: nothing turns or falls like this.
bool is_reading(const ImuSample& sample) {
  static constexpr double kMost = 1e4;
  const auto is_small = [](const Vec3& v) { return (v.array().abs() < kMost).all(); };
  return is_small(sample.angular_velocity_radps) && is_small(sample.specific_force_mps2);
}

// Of an IMU that can be used.
constexpr double kLeastPeriod_s = 1e-4, kMostPeriod_s = 0.2;

// The density that makes a rate's constant error of a step.
double density(double error, double step_s) { return error * std::sqrt(step_s); }

}  // namespace

ImuBuffer::Verdict ImuBuffer::add(const ImuSample& sample) {
  if (!is_reading(sample)) return Verdict::kPassedOver;
  Verdict verdict = Verdict::kTaken;
  if (!samples_.empty()) {
    const double step_s = seconds_between(sample.stamp, samples_.back().stamp);
    if (step_s <= 0) {
      if (++gone_back_ < kClockIsSetBack) return Verdict::kPassedOver;
      clear();
      verdict = Verdict::kClockSetBack;
    } else if (step_s > kFarAhead_s && is_ahead_alone(sample.stamp)) {
      return Verdict::kPassedOver;
    } else if (step_s < kMostGap_s) {  // the median, step by step
      const double next_s = usual_period_s_ * (step_s > usual_period_s_ ? 1.02 : 0.98);
      usual_period_s_ = std::clamp(next_s, kLeastPeriod_s, kMostPeriod_s);
    }
  }
  gone_back_ = gone_ahead_ = 0;
  count_equal(sample);
  samples_.push_back(sample);
  clipped_.push_back(false);
  if (equal_.maxCoeff() >= kEqualWhereClipped)
    std::fill(clipped_.end() - std::min<std::ptrdiff_t>(kEqualWhereClipped, std::ssize(clipped_)),
              clipped_.end(), true);
  return verdict;
}

/// Until several in a row agree, it is one wrong stamp.
bool ImuBuffer::is_ahead_alone(Timestamp stamp) {
  const double step_s = seconds_between(stamp, ahead_);
  const bool goes_on = gone_ahead_ > 0 && step_s > 0 && step_s <= kFarAhead_s;
  gone_ahead_ = goes_on ? gone_ahead_ + 1 : 1;
  ahead_ = stamp;
  return gone_ahead_ < kIsAhead;
}

void ImuBuffer::count_equal(const ImuSample& sample) {
  for (int i = 0; i < 6; ++i) {
    const auto value = [&](const ImuSample& s) {
      return i < 3 ? s.angular_velocity_radps[i] : s.specific_force_mps2[i - 3];
    };
    const double least = i < 3 ? kLeastGyroRange_radps : kLeastAccelRange_mps2;
    const bool is_high = std::abs(value(sample)) > least;
    const bool is_same = !samples_.empty() && value(samples_.back()) == value(sample);
    equal_[i] = !is_high ? 0 : is_same ? equal_[i] + 1 : 1;
  }
}

void ImuBuffer::forget_before(Timestamp stamp) {
  while (samples_.size() > 2 && samples_[1].stamp <= stamp) {
    samples_.pop_front();
    clipped_.pop_front();
  }
}

void ImuBuffer::clear() {
  samples_.clear();
  clipped_.clear();
  equal_.setZero();
  gone_back_ = gone_ahead_ = 0;
  usual_period_s_ = 1 / noise_.rate_hz;
}

void ImuBuffer::shift(std::int64_t by_ns) {
  for (ImuSample& sample : samples_) sample.stamp.ns += by_ns;
  if (gone_ahead_ > 0) ahead_.ns += by_ns;
}

Preintegration::Noise ImuBuffer::noise_of(std::size_t after) const {
  const double step_s = seconds_between(samples_[after].stamp, samples_[after - 1].stamp);
  const double rate_radps = samples_[after].angular_velocity_radps.norm();
  const double by_rate = gyro_scale_error_ * rate_radps * std::sqrt(kTurnsOneWay_s);
  Preintegration::Noise noise{std::hypot(noise_.gyro_noise_radps_sqrthz, by_rate),
                              noise_.accel_noise_mps2_sqrthz};
  const auto at_least = [&](double gyro_radps, double accel_mps2) {
    noise.gyro_radps_sqrthz = std::max(noise.gyro_radps_sqrthz, density(gyro_radps, step_s));
    noise.accel_mps2_sqrthz = std::max(noise.accel_mps2_sqrthz, density(accel_mps2, step_s));
  };
  if (step_s > kGapPeriods * usual_period_s_) at_least(kGapGyro_radps, kGapAccel_mps2);
  if (clipped_[after] || clipped_[after - 1]) at_least(kClippedGyro_radps, kClippedAccel_mps2);
  return noise;
}

std::optional<Preintegration> ImuBuffer::between(Timestamp from, Timestamp to,
                                                 const ImuBias& bias) const {
  if (samples_.empty() || samples_.front().stamp > from || to < from) return std::nullopt;
  if (seconds_between(to, samples_.back().stamp) > kMostWait_s) return std::nullopt;
  Preintegration result(bias);
  const auto integrate = [&](const ImuSample& a, const ImuSample& b,
                             const Preintegration::Noise& noise) {
    const ImuSample first = interpolated(a, b, std::max(from, a.stamp));
    const ImuSample last = interpolated(a, b, std::min(to, b.stamp));
    const double dt_s = seconds_between(last.stamp, first.stamp);
    if (dt_s <= 0) return;
    result.add(0.5 * (first.angular_velocity_radps + last.angular_velocity_radps),
               0.5 * (first.specific_force_mps2 + last.specific_force_mps2), dt_s, noise);
  };
  const auto begin = std::upper_bound(samples_.begin(), samples_.end(), from,
                                      [](Timestamp t, const ImuSample& s) { return t < s.stamp; });
  for (auto i = static_cast<std::size_t>(begin - samples_.begin());
       i < samples_.size() && samples_[i - 1].stamp < to; ++i) {
    if (seconds_between(samples_[i].stamp, samples_[i - 1].stamp) > kMostGap_s) return std::nullopt;
    integrate(samples_[i - 1], samples_[i], noise_of(i));
  }
  const ImuSample& newest = samples_.back();
  if (newest.stamp < to) {  // the samples of the last milliseconds are still to come
    ImuSample held = newest;
    held.stamp = to;
    const double step_s = seconds_between(to, newest.stamp);
    integrate(newest, held,
              {density(0.5 * step_s * kHandGyro_radps2, step_s),
               density(0.5 * step_s * kHandAccel_mps3, step_s)});
  }
  return result;
}

std::optional<ImuSample> ImuBuffer::reading(Timestamp at) const {
  if (samples_.empty()) return std::nullopt;
  if (at >= samples_.back().stamp) return samples_.back();
  if (at <= samples_.front().stamp) return samples_.front();
  const auto after = std::upper_bound(samples_.begin(), samples_.end(), at,
                                      [](Timestamp t, const ImuSample& s) { return t < s.stamp; });
  return interpolated(*(after - 1), *after, at);
}

bool ImuBuffer::was_clipped(Timestamp from, Timestamp to) const {
  for (std::size_t i = 0; i < samples_.size(); ++i)
    if (clipped_[i] && samples_[i].stamp >= from && samples_[i].stamp <= to) return true;
  return false;
}

}  // namespace ygslam
