// What the columns of a file of poses are, judged by unit quaternions, rotation matrices and stamps
// that increase.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "io/trajectory_columns.hpp"

namespace ygslam {

/// A file's poses, still as text, and what their columns are.
struct PoseText {
  std::vector<PoseRecord> records;
  PoseColumns columns;
  std::string taken_for;  ///< for people; empty for plain TUM
};

/// The formats that are told apart, for messages.
[[nodiscard]] std::string accepted_trajectories();

/// The columns of a TUM line from its position on.
[[nodiscard]] PoseColumns quaternion_from(std::size_t position_at);

/// @param poses records of one line each, nothing known of their columns.
/// @param first_line as it stands in the file: commas mark EuRoC's tables.
/// @return kInput naming file, line, what was found and what is accepted where nothing fits, or
/// more than one reading.
[[nodiscard]] Result<PoseText> by_evidence(PoseText poses, const std::string& name,
                                           std::string_view first_line);

}  // namespace ygslam
