// What stands in which column of a trajectory's lines.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

namespace ygslam {

enum class StampUnit { kSeconds, kMilliseconds, kMicroseconds, kNanoseconds };
[[nodiscard]] std::string_view name_of(StampUnit unit);

/// One pose as it is written: the fields of one line, or of the lines of one matrix.
struct PoseRecord {
  int line = 0;  ///< the first, counted from 1
  std::vector<std::string_view> fields;
};

/// Columns count from 0.
struct PoseColumns {
  enum class Pose { kQuaternion, kMatrix3x4, kMatrix4x4, kMatrix4x4ByColumns };
  enum class Stamp { kNone, kNumber, kSecondsAndNanoseconds, kImageName };

  Pose pose = Pose::kQuaternion;
  Stamp stamp = Stamp::kNumber;
  std::size_t stamp_at = 0;
  std::size_t nanoseconds_at = 0;
  std::optional<StampUnit> unit;  ///< nothing: to be found out
  std::array<std::size_t, 3> position_at{};
  std::array<std::size_t, 4> quaternion_at{};  ///< of x, y, z, w
  std::size_t matrix_at = 0;
  bool is_camera_from_world = false;  ///< the pose is that of the world in the camera
};

/// A stamp in another unit than seconds, without rounding through double.
[[nodiscard]] std::optional<Timestamp> parse_stamp(std::string_view word, StampUnit unit);

/// Length of the quaternion, NaN where a field is missing or no number.
[[nodiscard]] double quaternion_length(const PoseRecord& record,
                                       const std::array<std::size_t, 4>& at);

/// The unit that makes the stamps times of our age, where one does; else seconds.
[[nodiscard]] StampUnit unit_of_stamps(const std::vector<PoseRecord>& records,
                                       std::size_t stamp_at);

/// The columns that a line of names stands for. Names are those of TUM, EuRoC, pandas, rostopic,
/// COLMAP and the like: `tx`, `q_RS_w []`, `field.pose.position.x`, ...
/// @return nothing where the names are no complete pose. kInput: the names are those of a pose that
/// cannot be read (angles for a quaternion, a name twice).
[[nodiscard]] Result<std::optional<PoseColumns>> columns_of_names(
    const std::vector<std::string_view>& names);

/// Fields between commas or semicolons, empty ones too, without quotes and surrounding blanks.
[[nodiscard]] std::vector<std::string_view> csv_fields(std::string_view line);

}  // namespace ygslam
