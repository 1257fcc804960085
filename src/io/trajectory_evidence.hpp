// What a file of poses is, judged by all of its lines.
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

/// Decides by the header, the number of columns, unit quaternions, rotation matrices and stamps
/// that increase. Nothing is taken on trust: what fits nothing, or two things, is refused.
/// @param text without carriage returns inside lines. @param name for messages.
/// @return kInput naming file, line, what was found and what is accepted.
[[nodiscard]] Result<PoseText> recognise_poses(std::string_view text, const std::string& name);

}  // namespace ygslam
