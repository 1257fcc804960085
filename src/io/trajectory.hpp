// Trajectories as text in the TUM format: `stamp tx ty tz qx qy qz qw`.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

struct StampedPose {
  Timestamp stamp;
  SE3 T_world_camera;
};

/// Comments (#), blank lines, commas or tabs as separators and further columns are tolerated;
/// quaternions are normalised. Poses are returned in order of time, of equal stamps the first.
/// @param name for messages. @return kInput naming file and line: too few columns, not a finite
/// number, decimal commas, lines that end in CR alone, quaternion without length; or no pose at
/// all.
[[nodiscard]] Result<std::vector<StampedPose>> parse_tum_trajectory(std::string_view text,
                                                                    const std::string& name);
[[nodiscard]] Result<std::vector<StampedPose>> read_tum_trajectory(
    const std::filesystem::path& path);

/// One line with newline: the stamp with `stamp_decimals` digits, the pose with nine, qw >= 0, '.'
/// in every locale. The pose must be finite.
[[nodiscard]] std::string format_tum(const StampedPose& pose, int stamp_decimals);
/// All lines. Poses that are not finite are left out and logged as an error: better a gap than a
/// NaN.
[[nodiscard]] std::string format_tum(std::span<const StampedPose> poses, int stamp_decimals);

}  // namespace ygslam
