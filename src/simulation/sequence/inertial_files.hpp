// Files of the inertial sensor and of the wheels beside a sequence (docs/rendered-world.md).
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "simulation/sensor/imu_sensor.hpp"
#include "simulation/sensor/wheel_odometry.hpp"
#include "simulation/sequence/sequence_source.hpp"

namespace ygslam::sim {

inline constexpr const char* kImuReadings = "imu.csv";
inline constexpr const char* kImuPlace = "imu.yaml";
inline constexpr const char* kImuTruth = "imu_true.csv";
inline constexpr const char* kWheelPoses = "odom.csv";
inline constexpr const char* kWheelPlace = "odom.yaml";

/// What a user knows of the sensor: not its biases, and not its time offset.
[[nodiscard]] ImuCalibration known_calibration(const ImuOptions& options);

/// kImuReadings and kImuPlace, with `truth` kImuTruth (poses, velocities and biases in EuRoC's
/// columns), from a tenth of a second before the first frame to one after until_s.
/// @return kOutput naming the file.
[[nodiscard]] Status write_imu_files(const std::filesystem::path& folder,
                                     const SequenceSource& source, const ImuOptions& options,
                                     double until_s, bool truth);

/// kWheelPoses and kWheelPlace, of the same time. A camera that moves sideways gives a warning.
/// @return kOutput naming the file.
[[nodiscard]] Status write_wheel_file(const std::filesystem::path& folder,
                                      const SequenceSource& source, const WheelOptions& options,
                                      double until_s);

}  // namespace ygslam::sim
