// The newest samples of an IMU, and which of them are to be believed.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "inertial/imu_fault.hpp"
#include "inertial/imu_health.hpp"
#include "inertial/preintegration.hpp"

namespace ygslam {

class ImuBuffer {
 public:
  /// @param noise of good samples; rate_hz is a first guess.
  /// @param gyro_scale_error see InertialConfig.
  explicit ImuBuffer(const ImuNoise& noise, double gyro_scale_error = 0,
                     const ImuRange& range = {});

  enum class Verdict {
    kTaken,
    kPassedOver,    ///< no number, of no motion, not newer than the one before, or far ahead alone
    kLeftOut,       ///< no living sensor reads this: the sample is missing, see why_missing()
    kClockSetBack,  ///< so many in a row went back that time goes on from there: all is forgotten
  };
  /// A reading far from the one before is taken, or is missing, when the next one comes. Where
  /// readings hang, those already taken are missing from then on.
  Verdict add(const ImuSample& sample);
  void forget_before(Timestamp stamp);
  void clear();
  /// Adds to the stamps of all samples so far.
  void shift(std::int64_t by_ns);

  /// Rates that are missing for some samples, or that were clipped by the sensor's range, count as
  /// known to what a hand does, no better. @return nullopt if samples do not reach, or are missing
  /// for longer than a hand can be guessed.
  [[nodiscard]] std::optional<Preintegration> between(Timestamp from, Timestamp to,
                                                      const ImuBias& bias) const;
  /// Interpolated, or at the end of the samples the last one. @return nullopt without any.
  [[nodiscard]] std::optional<ImuSample> reading(Timestamp at) const;

  /// What was wrong with readings since then: kSilent where none came.
  [[nodiscard]] ImuFault why_missing(Timestamp since) const;
  [[nodiscard]] bool was_clipped(Timestamp from, Timestamp to) const;
  [[nodiscard]] const std::deque<ImuSample>& samples() const { return samples_; }

 private:
  enum class Quality : std::uint8_t { kGood, kClipped, kAfterMissing };
  [[nodiscard]] bool is_ahead_alone(Timestamp stamp);
  [[nodiscard]] ImuFault fault_of(const ImuSample& sample);
  void leave_out(const ImuSample& sample, ImuFault fault);
  void forget_repeated();
  void take(const ImuSample& sample);
  void append(const ImuSample& sample);
  void count_equal(const ImuSample& sample);
  [[nodiscard]] Preintegration::Noise noise_of(std::size_t after) const;

  ImuNoise noise_;
  double gyro_scale_error_;
  ImuRange range_;
  double usual_period_s_;
  std::deque<ImuSample> samples_;
  std::deque<Quality> quality_;    // of each
  std::optional<Timestamp> last_;  // whether it was taken or not
  std::optional<ImuSample> far_;   // the last one, until the next tells what it is
  int since_far_ = 0;              // samples
  RepeatedReading gyro_, accel_;
  ImuFault fault_ = ImuFault::kNone;    // of the last reading that was left out, ...
  Timestamp faulty_at_;                 // ... which was then, ...
  bool is_missing_ = false;             // ... after the last one that was taken
  Eigen::Array<int, 6, 1> equal_ = {};  // readings in a row, of each axis
  int gone_back_ = 0;                   // samples in a row
  int gone_ahead_ = 0;                  // the same, ...
  Timestamp ahead_;                     // ... and the last of them
};

}  // namespace ygslam
