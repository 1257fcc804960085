// The IMU of a recording: its readings, and where it is on the camera.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/run_options.hpp"
#include "geometry/imu.hpp"

namespace ygslam {

struct ImuInput {
  std::optional<ImuCalibration> calibration;  ///< nullopt: no IMU is used
  std::vector<ImuSample> samples;             ///< in order of time
  std::string told;                           ///< one line about it for the log, or empty
};

/// What --imu and --imu-calibration name, else imu.csv with imu.yaml of a folder.
/// @return kUsage for a topic or a file without a calibration, and of a stream; else as read_imu(),
/// read_bag_imu() and read_imu_calibration().
[[nodiscard]] Result<ImuInput> open_imu(const RunOptions& options, const Sequence& sequence);

}  // namespace ygslam
