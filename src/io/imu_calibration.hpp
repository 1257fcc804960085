// imu.yaml: where the IMU is on the camera, and how much it errs (docs/inputs.md).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "geometry/imu.hpp"

namespace ygslam {

/// Lines `key: value`; or Kalibr's imu.yaml and its camchain with an IMU, one after the other.
/// @param name for messages. @return kConfig naming file and line (of Kalibr's: file and key): an
/// unknown key (of Kalibr's: one that looks like a key that is read) or one that is given twice, no
/// finite number, a value out of bounds, no unit quaternion or rotation; or a key that is missing.
[[nodiscard]] Result<ImuCalibration> parse_imu_calibration(std::string_view text,
                                                           const std::string& name);
/// @return kInput if the file cannot be read, else as parse_imu_calibration().
[[nodiscard]] Result<ImuCalibration> read_imu_calibration(const std::filesystem::path& path);

/// @param comment one line, put first.
[[nodiscard]] std::string format_imu_calibration(const ImuCalibration& imu,
                                                 std::string_view comment);

}  // namespace ygslam
