// Trajectories in the formats of benchmarks and SLAM systems (docs/inputs.md).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "io/trajectory.hpp"
#include "io/trajectory_columns.hpp"

namespace ygslam {

/// What a file can be declared to be.
enum class TrajectoryFormat {
  kTum,    ///< `stamp tx ty tz qx qy qz qw`
  kKitti,  ///< 12 numbers: the upper three rows of the pose's matrix; no stamps
  kEuroc,  ///< CSV `stamp,px,py,pz,qw,qx,qy,qz,...`, nanoseconds
};
[[nodiscard]] std::optional<TrajectoryFormat> parse_trajectory_format(std::string_view name);
[[nodiscard]] std::string_view name_of(TrajectoryFormat format);
/// `s`, `ms`, `us`, `ns`.
[[nodiscard]] std::optional<StampUnit> parse_stamp_unit(std::string_view name);

struct TrajectoryReading {
  std::optional<TrajectoryFormat> format = {};  ///< nothing: recognised by its content
  std::optional<StampUnit> unit = {};  ///< nothing: seconds, or another where that is plain
};

struct TrajectoryFile {
  /// Without stamps the n-th pose, counted from 0, has the stamp n ns.
  std::vector<StampedPose> poses;
  bool has_stamps = true;
  bool reads_w_first = false;  ///< its quaternions were taken as qw qx qy qz
  std::string taken_for;       ///< what the file was recognised as; empty for plain TUM
  std::string topic;           ///< of a bag
};

/// Poses in order of time (without stamps: of the file); of equal stamps the first.
/// @param name for messages. @return kInput naming file and line: what fits no format or two, too
/// few or too many columns, not a finite number, no unit quaternion, no rotation matrix, decimal
/// commas, lines that end in CR alone, a unit of time that is plainly another one; or no pose.
[[nodiscard]] Result<TrajectoryFile> parse_trajectory(std::string_view text,
                                                      const std::string& name,
                                                      const TrajectoryReading& reading = {});
/// The same of a file, or of a folder with poses (folder_truth.hpp). What it was taken for is
/// logged, unless that is plain TUM.
[[nodiscard]] Result<TrajectoryFile> read_trajectory(const std::filesystem::path& path,
                                                     const TrajectoryReading& reading = {});
/// The same of a file that must have stamps. @return kInput if it has none.
[[nodiscard]] Result<std::vector<StampedPose>> read_stamped_trajectory(
    const std::filesystem::path& path);

/// The program's own files, which are TUM: they are not asked whether they might be something else.
/// Comments (#), blank lines, commas or tabs as separators and further columns are tolerated;
/// quaternions are normalised. Poses are returned in order of time, of equal stamps the first.
/// @param name for messages. @return kInput naming file and line: too few columns, not a finite
/// number, decimal commas, lines that end in CR alone, no unit quaternion; or no pose at all.
[[nodiscard]] Result<std::vector<StampedPose>> parse_tum_trajectory(std::string_view text,
                                                                    const std::string& name);
[[nodiscard]] Result<std::vector<StampedPose>> read_tum_trajectory(
    const std::filesystem::path& path);

/// Gives a trajectory without stamps those of a file, one a line [s].
/// @return kInput: unreadable, not one stamp for each pose, or stamps that do not increase.
[[nodiscard]] Status add_stamps(const std::filesystem::path& times, const std::string& name,
                                TrajectoryFile& trajectory);

}  // namespace ygslam
