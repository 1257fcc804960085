// Trajectories in the formats of the common benchmarks: TUM RGB-D, KITTI odometry, EuRoC MAV.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "io/trajectory.hpp"

namespace ygslam {

enum class TrajectoryFormat {
  kTum,    ///< `stamp tx ty tz qx qy qz qw`, seconds
  kKitti,  ///< 12 numbers: the upper three rows of the pose's matrix; no stamps
  kEuroc,  ///< CSV `stamp,px,py,pz,qw,qx,qy,qz,...`, nanoseconds
};
[[nodiscard]] std::optional<TrajectoryFormat> parse_trajectory_format(std::string_view name);
[[nodiscard]] std::string_view name_of(TrajectoryFormat format);

struct TrajectoryFile {
  TrajectoryFormat format = TrajectoryFormat::kTum;
  /// Without stamps (KITTI) the n-th pose, counted from 0, has the stamp n ns.
  std::vector<StampedPose> poses;
  bool has_stamps = true;
};

/// The format that the first line of data has: 12 numbers are KITTI, commas with a whole number of
/// nanoseconds in front are EuRoC, anything else is taken for TUM.
[[nodiscard]] TrajectoryFormat recognise_trajectory(std::string_view text);

/// Poses in order of time (KITTI: of the file); of equal stamps the first.
/// @param format nothing: recognised by content.
/// @param name for messages. @return kInput naming file and line: too few or too many columns, not
/// a finite number, quaternion without length, matrix that is no rotation, decimal commas, lines
/// that end in CR alone, a format or a unit of time that is plainly another one; or no pose at all.
[[nodiscard]] Result<TrajectoryFile> parse_trajectory(std::string_view text,
                                                      const std::string& name,
                                                      std::optional<TrajectoryFormat> format = {});
[[nodiscard]] Result<TrajectoryFile> read_trajectory(const std::filesystem::path& path,
                                                     std::optional<TrajectoryFormat> format = {});

/// What must be TUM and is not asked whether it might be something else: ground truth, own output.
/// Comments (#), blank lines, commas or tabs as separators and further columns are tolerated;
/// quaternions are normalised. Poses are returned in order of time, of equal stamps the first.
/// @param name for messages. @return kInput naming file and line: too few columns, not a finite
/// number, decimal commas, lines that end in CR alone, quaternion without length; or no pose at
/// all.
[[nodiscard]] Result<std::vector<StampedPose>> parse_tum_trajectory(std::string_view text,
                                                                    const std::string& name);
[[nodiscard]] Result<std::vector<StampedPose>> read_tum_trajectory(
    const std::filesystem::path& path);

/// Gives a trajectory without stamps those of a file, one a line [s].
/// @return kInput: unreadable, not one stamp for each pose, or stamps that do not increase.
[[nodiscard]] Status add_stamps(const std::filesystem::path& times, const std::string& name,
                                TrajectoryFile& trajectory);

}  // namespace ygslam
