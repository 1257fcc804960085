#include "io/trajectory_evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/statistics.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"
#include "io/trajectory_sample.hpp"

namespace ygslam {
namespace {

using Pose = PoseColumns::Pose;
using Stamp = PoseColumns::Stamp;

constexpr double kIncreasingShare = 0.9;

/// By how much four numbers differ from unit length; NaN where one is missing.
double unit_error(const std::vector<double>& row, std::size_t at) {
  const double squares = row[at] * row[at] + row[at + 1] * row[at + 1] + row[at + 2] * row[at + 2] +
                         row[at + 3] * row[at + 3];
  return std::abs(std::sqrt(squares) - 1);
}

bool is_unit(const std::vector<double>& row, std::size_t at) {
  return at + 4 <= row.size() && unit_error(row, at) < kQuaternionTolerance;
}

// @param stride between the rows of the matrix, step between its columns.
bool is_rotation_at(const std::vector<double>& row, std::size_t at, std::size_t stride,
                    std::size_t step) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k)
        dot += row[at + i * stride + k * step] * row[at + j * stride + k * step];
      if (!(std::abs(dot - (i == j ? 1 : 0)) < kRotationTolerance)) return false;
    }
  }
  return true;
}

bool is_matrix(const std::vector<double>& row, std::size_t at, Pose pose) {
  const std::size_t size = pose == Pose::kMatrix3x4 ? 12 : 16;
  if (at + size > row.size() || !is_rotation_at(row, at, 4, 1)) return false;
  if (pose == Pose::kMatrix3x4) return true;
  const bool by_columns = pose == Pose::kMatrix4x4ByColumns;
  for (std::size_t k = 0; k < 4; ++k) {
    const double value = by_columns ? row[at + 4 * k + 3] : row[at + 12 + k];
    if (!(std::abs(value - (k == 3 ? 1 : 0)) < 1e-6)) return false;
  }
  return true;
}

bool increases(const PoseSample& sample, std::size_t at) {
  return sample.share_of_steps([at](const auto& a, const auto& b) { return a[at] < b[at]; }) >=
         kIncreasingShare;
}

bool is_whole(const PoseSample& sample, std::size_t at) {
  return sample.share([at](const auto& row) { return row[at] == std::floor(row[at]); }) == 1;
}

bool counts(const PoseSample& sample, std::size_t at) {
  return is_whole(sample, at) && sample.share_of_steps([at](const auto& a, const auto& b) {
    return b[at] == a[at] + 1;
  }) >= kIncreasingShare;
}

bool is_split_stamp(const PoseSample& sample, std::size_t at) {
  return is_whole(sample, at) && is_whole(sample, at + 1) &&
         sample.share([at](const auto& row) { return row[at + 1] >= 0 && row[at + 1] < 1e9; }) ==
             1 &&
         sample.share_of_steps([at](const auto& a, const auto& b) {
           return a[at] < b[at] || (a[at] == b[at] && a[at + 1] < b[at + 1]);
         }) >= kIncreasingShare &&
         // Nanoseconds are large numbers, and not in step with the lines; microseconds are below.
         sample.share([at](const auto& row) { return row[at + 1] >= 1e6; }) >= kLeastShareOfPoses;
}

struct PoseReading {
  PoseColumns columns;
  std::string title;
};

void add_matrices(const PoseSample& sample, std::vector<PoseReading>& found) {
  const auto add = [&](std::size_t columns, Pose pose, const char* title) {
    const std::size_t at = columns % 4 == 0 ? 0 : 1;
    if (sample.columns != columns || sample.share([&](const auto& row) {
          return is_matrix(row, at, pose);
        }) < kLeastShareOfPoses)
      return;
    PoseColumns layout;
    layout.pose = pose;
    layout.stamp = at == 0 ? Stamp::kNone : Stamp::kNumber;
    layout.matrix_at = at;
    found.push_back({layout, title});
  };
  add(12, Pose::kMatrix3x4, "KITTI (3x4 matrices, no stamps)");
  add(13, Pose::kMatrix3x4, "stamp and 3x4 matrix");
  add(16, Pose::kMatrix4x4, "4x4 matrices, no stamps");
  add(16, Pose::kMatrix4x4ByColumns, "4x4 matrices column by column, no stamps");
  add(17, Pose::kMatrix4x4, "stamp and 4x4 matrix");
  add(17, Pose::kMatrix4x4ByColumns, "stamp and 4x4 matrix column by column");
}

// How many columns of stamp stand before the position, and what they are.
void add_quaternions(const PoseSample& sample, std::vector<PoseReading>& found) {
  const auto fits = [&](std::size_t before) {
    return sample.columns >= before + 7 && sample.share([&](const auto& row) {
      return is_unit(row, before + 3);
    }) >= kLeastShareOfPoses;
  };
  const auto add = [&](std::size_t before, Stamp stamp, std::size_t stamp_at, const char* title) {
    PoseColumns layout = quaternion_from(before);
    layout.stamp = stamp;
    layout.stamp_at = stamp_at;
    layout.nanoseconds_at = stamp_at + 1;
    found.push_back({layout, title});
  };
  if (sample.columns == 7 && fits(0)) add(0, Stamp::kNone, 0, "x y z qx qy qz qw, no stamps");
  if (fits(1)) add(1, Stamp::kNumber, 0, "");
  if (fits(2) && counts(sample, 0) && increases(sample, 1))
    add(2, Stamp::kNumber, 1, "number, stamp, x y z qx qy qz qw");
  if (fits(2) && is_split_stamp(sample, 0))
    add(2, Stamp::kSecondsAndNanoseconds, 0, "seconds, nanoseconds, x y z qx qy qz qw");
  if (fits(3) && counts(sample, 0) && is_split_stamp(sample, 1))
    add(3, Stamp::kSecondsAndNanoseconds, 1, "number, seconds, nanoseconds, x y z qx qy qz qw");
}

std::string column_range(std::size_t first) {
  return std::to_string(first + 1) + " to " + std::to_string(first + 4);
}

/// Of the middle line.
double unit_error(const PoseSample& sample, std::size_t at) {
  std::vector<double> errors;
  for (const auto& row : sample.rows)
    if (is_unit(row, at)) errors.push_back(unit_error(row, at));
  return median(std::move(errors));
}

bool varies(const PoseSample& sample, std::size_t at) {
  return std::any_of(sample.rows.begin(), sample.rows.end(),
                     [&](const auto& row) { return row[at] != sample.rows.front()[at]; });
}

/// A row of a rotation, or the end of another quaternion, beside small translations is nearly of
/// unit length, too. @return what stands there instead of x y z qx qy qz qw; empty if nothing does.
std::string what_else_stands_there(const PoseSample& sample, std::size_t position_at) {
  const auto is_apart = [&](std::size_t at, std::size_t size) {
    return at + size <= position_at || at >= position_at + 7;
  };
  for (const std::size_t stride : {3, 4}) {
    const std::size_t size = 2 * stride + 3;
    for (std::size_t at = 0; at + size <= sample.columns; ++at) {
      const auto is_rotation = [&](const auto& row) { return is_rotation_at(row, at, stride, 1); };
      if (!is_apart(at, size) && sample.share(is_rotation) >= kLeastShareOfPoses)
        return std::to_string(at + 1) + " to " + std::to_string(at + size) +
               " have a rotation matrix in them";
    }
  }
  constexpr double kWrittenError = 5e-5, kClearly = 10;
  const double error = unit_error(sample, position_at + 3);
  for (std::size_t at = 0; error > kWrittenError && at + 4 <= sample.columns; ++at) {
    const auto is_unit_here = [at](const auto& row) { return is_unit(row, at); };
    if (is_apart(at, 4) || at == position_at + 3 || !(varies(sample, at) || varies(sample, at + 1)))
      continue;
    if (sample.share(is_unit_here) >= kLeastShareOfPoses &&
        kClearly * unit_error(sample, at) < error)
      return column_range(at) + " have unit length as a quaternion has, more exactly than " +
             column_range(position_at + 3);
  }
  return {};
}

std::string what_stands_there(const PoseSample& sample) {
  std::string text = std::to_string(sample.columns) + " columns";
  for (std::size_t at = 0; at + 4 <= sample.columns; ++at) {
    if (sample.share([at](const auto& row) { return is_unit(row, at); }) < kLeastShareOfPoses)
      continue;
    return text + ", of which " + column_range(at) + " have unit length as a quaternion has";
  }
  if (sample.columns == 8) {
    double squares = 0;
    for (std::size_t i = 4; i < 8; ++i) squares += sample.rows[0][i] * sample.rows[0][i];
    std::array<char, 64> length{};
    std::snprintf(length.data(), length.size(), "%.3g", std::sqrt(squares));
    return text + ", of which " + column_range(4) + " are no unit quaternion (length " +
           length.data() + ")";
  }
  return text + ", with no unit quaternion and no rotation matrix in the same place of each";
}

Error no_format(const std::string& name, const PoseRecord& record, const std::string& found) {
  return {ErrorKind::kInput,
          name + ":" + std::to_string(record.line) + ": " + found + "; " + accepted_trajectories()};
}

// EuRoC's tables have no other mark where the header is gone: commas and whole nanoseconds.
bool is_euroc(const PoseText& poses, const PoseSample& sample, std::string_view first_line) {
  constexpr std::size_t kLeastDigits = 12;
  const auto& fields = poses.records.front().fields;
  const std::string_view stamp = fields.empty() ? std::string_view() : fields.front();
  return first_line.find(',') != std::string_view::npos && stamp.size() >= kLeastDigits &&
         std::all_of(stamp.begin(), stamp.end(), [](char c) { return c >= '0' && c <= '9'; }) &&
         sample.columns >= 8;
}

// Which of two readings that both fit is meant; nothing if that cannot be told.
std::optional<PoseReading> choose(const PoseSample& sample, std::vector<PoseReading> found) {
  const auto is_matrix_reading = [](const PoseReading& c) {
    return c.columns.pose != Pose::kQuaternion;
  };
  if (std::any_of(found.begin(), found.end(), is_matrix_reading))
    std::erase_if(found, [&](const PoseReading& c) { return !is_matrix_reading(c); });
  if (found.size() == 1) return found.front();
  const bool are_matrices = is_matrix_reading(found.front());
  if (are_matrices) {  // by rows and by columns: the same only where nothing turns
    const std::size_t at = found.front().columns.matrix_at;
    const bool symmetric = sample.share([at](const auto& row) {
      return row[at + 1] == row[at + 4] && row[at + 2] == row[at + 8] && row[at + 6] == row[at + 9];
    }) == 1;
    return symmetric ? std::optional(found.front()) : std::nullopt;
  }
  // TUM with further columns needs a first column that is a time, not a count of lines.
  std::erase_if(found, [&](const PoseReading& c) {
    return c.title.empty() && (!increases(sample, 0) || counts(sample, 0));
  });
  return found.size() == 1 ? std::optional(found.front()) : std::nullopt;
}

void shift_columns(const std::vector<std::size_t>& kept, PoseColumns& columns) {
  for (std::size_t& at : columns.position_at) at = kept[at];
  for (std::size_t& at : columns.quaternion_at) at = kept[at];
  columns.nanoseconds_at =
      columns.stamp == Stamp::kSecondsAndNanoseconds ? kept[columns.nanoseconds_at] : 0;
  columns.stamp_at = kept[columns.stamp_at];
  columns.matrix_at = kept[columns.matrix_at];
}

}  // namespace

std::string accepted_trajectories() {
  return "read are `stamp x y z qx qy qz qw` (TUM), EuRoC, 3x4 or 4x4 matrices (KITTI, Replica), "
         "COLMAP, or a header line that names the columns (docs/inputs.md)";
}

PoseColumns quaternion_from(std::size_t position_at) {
  PoseColumns columns;
  for (std::size_t i = 0; i < 3; ++i) columns.position_at[i] = position_at + i;
  for (std::size_t i = 0; i < 4; ++i) columns.quaternion_at[i] = position_at + 3 + i;
  return columns;
}

Result<PoseText> by_evidence(PoseText poses, const std::string& name, std::string_view first_line) {
  const PoseSample whole = sample_of(poses.records);
  const auto kept = columns_of_numbers(whole);
  const PoseSample sample = only_columns(whole, kept);
  std::vector<PoseReading> found;
  add_matrices(sample, found);
  add_quaternions(sample, found);
  const PoseRecord& first = *whole.records.front();
  if (found.empty()) return no_format(name, first, what_stands_there(sample));
  const auto chosen = choose(sample, found);
  if (!chosen) {
    return no_format(name, first,
                     std::to_string(sample.columns) + " columns that can be read in " +
                         std::to_string(found.size()) + " ways");
  }
  if (chosen->columns.pose == Pose::kQuaternion) {
    const std::string other = what_else_stands_there(sample, chosen->columns.position_at[0]);
    if (!other.empty())
      return no_format(name, first, std::to_string(sample.columns) + " columns, of which " + other);
  }
  poses.columns = chosen->columns;
  poses.taken_for = chosen->title;
  const StampUnit unit = unit_of_stamps(poses.records, 0);
  const bool may_be_ns = unit == StampUnit::kSeconds || unit == StampUnit::kNanoseconds;
  if (chosen->title.empty() && may_be_ns && is_euroc(poses, whole, first_line)) {
    poses.columns.quaternion_at = {5, 6, 7, 4};
    poses.columns.unit = StampUnit::kNanoseconds;
    poses.taken_for = "EuRoC (quaternion with w first)";
    return poses;
  }
  shift_columns(kept, poses.columns);
  if (chosen->title.empty() && kept.front() != 0) poses.taken_for = "TUM after a column of text";
  if (poses.taken_for.empty() && whole.columns > 8)
    poses.taken_for = "TUM, columns beyond the 8th left out";
  return poses;
}

}  // namespace ygslam
