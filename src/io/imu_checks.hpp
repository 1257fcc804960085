// Inertial readings in other units, or with axes that do not belong together: gravity tells.
#pragma once

#include <span>
#include <string>

#include "geometry/imu.hpp"

namespace ygslam {

struct ImuDoubt {
  std::string what;       ///< empty: nothing speaks against the readings
  bool is_fault = false;  ///< they cannot be what they should be, and are of no use
};

/// @param samples in order of time. @param has_gyro false: angular velocities are not looked at.
[[nodiscard]] ImuDoubt doubt_about(std::span<const ImuSample> samples, bool has_gyro);

/// Between two readings: 0.1 ms to 0.2 s.
[[nodiscard]] bool is_sensors_interval(double step_s);
/// Stamps that are no sensor's: another interval, at the median.
/// @param samples in order of time. @return what speaks against them; empty: nothing.
[[nodiscard]] std::string fault_of_intervals(std::span<const ImuSample> samples);

/// @return where the calibration says another rate than the readings have; empty: it does not.
[[nodiscard]] std::string doubt_about_rate(std::span<const ImuSample> samples,
                                           const ImuCalibration& imu);

}  // namespace ygslam
