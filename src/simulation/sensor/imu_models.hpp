// Inertial sensors that cameras are sold with, by the figures of their data sheets.
#pragma once

#include <span>
#include <string_view>

#include "geometry/imu.hpp"

namespace ygslam::sim {

/// How far a sensor errs as it leaves the factory of the chip. Errors of each axis are drawn with
/// these standard deviations; 0 = none.
struct ImuModel {
  std::string_view name;
  ImuNoise noise;
  double gyro_offset_radps = 0;  ///< bias at the start
  double accel_offset_mps2 = 0;
  double gyro_scale = 0;  ///< relative
  double accel_scale = 0;
  double gyro_misalignment_rad = 0;  ///< of an axis towards each of the others
  double accel_misalignment_rad = 0;
  double gyro_range_radps = 0;  ///< readings stop here; 0 = never
  double accel_range_mps2 = 0;
  double gyro_step_radps = 0;  ///< of the last digit
  double accel_step_mps2 = 0;
};

/// `ideal` first, which errs in nothing.
[[nodiscard]] std::span<const ImuModel> imu_models();
/// @return null if there is none of that name.
[[nodiscard]] const ImuModel* find_imu_model(std::string_view name);

}  // namespace ygslam::sim
