// The newest samples of an IMU, and which of them are to be believed.
#pragma once

#include <deque>
#include <optional>

#include "inertial/preintegration.hpp"

namespace ygslam {

class ImuBuffer {
 public:
  /// @param noise of good samples; rate_hz is a first guess.
  /// @param gyro_scale_error see InertialConfig.
  explicit ImuBuffer(const ImuNoise& noise, double gyro_scale_error = 0)
      : noise_(noise), gyro_scale_error_(gyro_scale_error), usual_period_s_(1 / noise.rate_hz) {}

  enum class Verdict {
    kTaken,
    kPassedOver,    ///< no number, of no motion, not newer than the one before, or far ahead alone
    kClockSetBack,  ///< so many in a row went back that time goes on from there: all is forgotten
  };
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

  [[nodiscard]] bool was_clipped(Timestamp from, Timestamp to) const;
  [[nodiscard]] const std::deque<ImuSample>& samples() const { return samples_; }

 private:
  [[nodiscard]] bool is_ahead_alone(Timestamp stamp);
  void count_equal(const ImuSample& sample);
  [[nodiscard]] Preintegration::Noise noise_of(std::size_t after) const;

  ImuNoise noise_;
  double gyro_scale_error_;
  double usual_period_s_;
  std::deque<ImuSample> samples_;
  std::deque<bool> clipped_;            // of each
  Eigen::Array<int, 6, 1> equal_ = {};  // readings in a row, of each axis
  int gone_back_ = 0;                   // samples in a row
  int gone_ahead_ = 0;                  // the same, ...
  Timestamp ahead_;                     // ... and the last of them
};

}  // namespace ygslam
