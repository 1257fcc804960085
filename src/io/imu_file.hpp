// Readings of inertial sensors as text (docs/inputs.md): EuRoC's CSV, lines `t wx wy wz ax ay az`,
// TUM's accelerometer.txt.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "geometry/imu.hpp"

namespace ygslam {

/// Readings in order of time; of equal stamps the first. Both, and stamps that were not in order,
/// are told in a warning, as is a gyroscope that does not turn gravity as the accelerometer sees
/// it. A header, or a comment before the data, may name the columns in any order.
/// @param name for messages. @return kInput naming the file, and the line where it is one: another
/// number of columns, not a finite number of sensible size, an accelerometer alone, units that are
/// plainly others (gravity of 1 or 1000, degrees, stamps that are no sensor's), no gravity at all.
[[nodiscard]] Result<std::vector<ImuSample>> parse_imu(std::string_view text,
                                                       const std::string& name);
[[nodiscard]] Result<std::vector<ImuSample>> read_imu(const std::filesystem::path& path);

struct AccelerometerSample {
  Timestamp stamp;
  Vec3 specific_force_mps2;  ///< as of ImuSample, in the accelerometer's own frame
};

/// The same of a file with accelerations alone, as TUM's accelerometer.txt; what else the lines
/// hold is left out if a header names it.
[[nodiscard]] Result<std::vector<AccelerometerSample>> parse_accelerometer(std::string_view text,
                                                                           const std::string& name);
[[nodiscard]] Result<std::vector<AccelerometerSample>> read_accelerometer(
    const std::filesystem::path& path);

/// EuRoC's CSV with its header; numbers read back the same to the bit.
[[nodiscard]] std::string format_imu(std::span<const ImuSample> samples);

}  // namespace ygslam
