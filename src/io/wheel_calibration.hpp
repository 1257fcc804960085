// odom.yaml: where the camera is on the robot, and how much its wheels err (docs/inertial.md).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "geometry/imu.hpp"

namespace ygslam {

/// Lines `key: value`. @param name for messages. @return kConfig, see parse_sensor_yaml().
[[nodiscard]] Result<WheelCalibration> parse_wheel_calibration(std::string_view text,
                                                               const std::string& name);
/// @return kInput if the file cannot be read, else as parse_wheel_calibration().
[[nodiscard]] Result<WheelCalibration> read_wheel_calibration(const std::filesystem::path& path);

/// @param comment one line, put first.
[[nodiscard]] std::string format_wheel_calibration(const WheelCalibration& wheels,
                                                   std::string_view comment);

}  // namespace ygslam
