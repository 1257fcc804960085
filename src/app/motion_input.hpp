// What else of a recording tells how the camera moves: its IMU's readings, its robot's wheels, and
// where they are.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/run_options.hpp"
#include "bag/motion_beside.hpp"
#include "geometry/imu.hpp"

namespace ygslam {

template <typename Calibration, typename Sample>
struct MotionInput {
  std::optional<Calibration> calibration;  ///< nullopt: none is used
  std::vector<Sample> samples;             ///< in order of time
  std::string told;                        ///< one line about it for the log, or empty
};
using ImuInput = MotionInput<ImuCalibration, ImuSample>;
using WheelInput = MotionInput<WheelCalibration, OdometrySample>;

/// What --imu and --imu-calibration name, else imu.csv with imu.yaml of a folder. Where the sensor
/// is says the calibration file, else /tf_static of a bag or stream.
/// Of a stream what its topic tells comes with the frames: there are no samples then.
/// @return kUsage for a topic or a file without a place, a file beside a stream; else as
/// read_imu(), read_bag_imu() and read_imu_calibration().
[[nodiscard]] Result<ImuInput> open_imu(const RunOptions& options, const Sequence& sequence);

/// The same of --odometry and --odometry-calibration, odom.csv and odom.yaml.
[[nodiscard]] Result<WheelInput> open_wheels(const RunOptions& options, const Sequence& sequence);

/// What of a stream has to be waited for.
[[nodiscard]] WantedMotion wanted_motion(const RunOptions& options);

}  // namespace ygslam
