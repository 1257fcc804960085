#include "inertial/imu_buffer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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
constexpr int kAloneAmong = 10;  // readings, one is far: more shake

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

ImuBuffer::ImuBuffer(const ImuNoise& noise, double gyro_scale_error, const ImuRange& range)
    : noise_(noise),
      gyro_scale_error_(gyro_scale_error),
      range_(range),
      usual_period_s_(1 / noise.rate_hz),
      gyro_(noise.gyro_noise_radps_sqrthz * std::sqrt(noise.rate_hz)),
      accel_(noise.accel_noise_mps2_sqrthz * std::sqrt(noise.rate_hz)) {}

ImuBuffer::Verdict ImuBuffer::add(const ImuSample& sample) {
  if (!is_reading(sample)) return Verdict::kPassedOver;
  Verdict verdict = Verdict::kTaken;
  if (last_) {
    const double step_s = seconds_between(sample.stamp, *last_);
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
  last_ = sample.stamp;
  if (const ImuFault fault = fault_of(sample); fault == ImuFault::kNone) {
    take(sample);
  } else {
    leave_out(sample, fault);
    if (verdict == Verdict::kTaken) return Verdict::kLeftOut;
  }
  return verdict;
}

ImuFault ImuBuffer::fault_of(const ImuSample& sample) {
  const bool gyro_hangs = gyro_.add(sample.angular_velocity_radps, usual_period_s_);
  const bool accel_hangs = accel_.add(sample.specific_force_mps2, usual_period_s_);
  if (gyro_hangs || accel_hangs) {
    forget_repeated();
    return ImuFault::kStands;
  }
  if (sample.specific_force_mps2.isZero(0)) return ImuFault::kStands;  // nothing on Earth does
  return is_beyond_range(sample, range_) ? ImuFault::kRange : ImuFault::kNone;
}

void ImuBuffer::leave_out(const ImuSample& sample, ImuFault fault) {
  fault_ = fault;
  faulty_at_ = sample.stamp;
  is_missing_ = true;
}

/// Of a sensor that hangs the first reading was right.
void ImuBuffer::forget_repeated() {
  far_.reset();
  const auto repeats = [&] {
    if (samples_.size() < 2) return false;
    const ImuSample &last = samples_.back(), &before = samples_[samples_.size() - 2];
    return last.angular_velocity_radps == before.angular_velocity_radps ||
           last.specific_force_mps2 == before.specific_force_mps2;
  };
  while (repeats()) {
    samples_.pop_back();
    quality_.pop_back();
  }
}

void ImuBuffer::take(const ImuSample& sample) {
  ++since_far_;
  if (far_) {
    const ImuSample far = *std::exchange(far_, std::nullopt);
    if (is_far_alone(far, samples_.back(), sample)) {
      leave_out(far, ImuFault::kRange);
    } else {
      append(far);
    }
    since_far_ = 0;
  }
  const bool is_other = !samples_.empty() && is_far(sample, samples_.back());
  if (is_other && since_far_ > kAloneAmong && !is_missing_) {
    far_ = sample;
    return;
  }
  if (is_other) since_far_ = 0;  // it shakes
  append(sample);
}

void ImuBuffer::append(const ImuSample& sample) {
  count_equal(sample);
  samples_.push_back(sample);
  quality_.push_back(std::exchange(is_missing_, false) ? Quality::kAfterMissing : Quality::kGood);
  if (equal_.maxCoeff() >= kEqualWhereClipped)
    std::fill(quality_.end() - std::min<std::ptrdiff_t>(kEqualWhereClipped, std::ssize(quality_)),
              quality_.end(), Quality::kClipped);
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
    quality_.pop_front();
  }
}

void ImuBuffer::clear() {
  samples_.clear();
  quality_.clear();
  last_.reset();
  far_.reset();
  since_far_ = 0;
  fault_ = ImuFault::kNone;
  is_missing_ = false;
  equal_.setZero();
  gone_back_ = gone_ahead_ = 0;
  usual_period_s_ = 1 / noise_.rate_hz;
}

void ImuBuffer::shift(std::int64_t by_ns) {
  for (ImuSample& sample : samples_) sample.stamp.ns += by_ns;
  if (gone_ahead_ > 0) ahead_.ns += by_ns;
  if (last_) last_->ns += by_ns;
  if (far_) far_->stamp.ns += by_ns;
  faulty_at_.ns += by_ns;
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
  if (step_s > kGapPeriods * usual_period_s_ || quality_[after] == Quality::kAfterMissing)
    at_least(kGapGyro_radps, kGapAccel_mps2);
  if (quality_[after] == Quality::kClipped || quality_[after - 1] == Quality::kClipped)
    at_least(kClippedGyro_radps, kClippedAccel_mps2);
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
  const auto begin = std::ranges::upper_bound(samples_, from, {}, &ImuSample::stamp);
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
  const auto after = std::ranges::upper_bound(samples_, at, {}, &ImuSample::stamp);
  return interpolated(*(after - 1), *after, at);
}

ImuFault ImuBuffer::why_missing(Timestamp since) const {
  return fault_ != ImuFault::kNone && faulty_at_ >= since ? fault_ : ImuFault::kSilent;
}

bool ImuBuffer::was_clipped(Timestamp from, Timestamp to) const {
  for (std::size_t i = 0; i < samples_.size(); ++i)
    if (quality_[i] == Quality::kClipped && samples_[i].stamp >= from && samples_[i].stamp <= to)
      return true;
  return false;
}

}  // namespace ygslam
