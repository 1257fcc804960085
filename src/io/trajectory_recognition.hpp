// What a file of poses is, judged by all of its lines.
#pragma once

#include <string>
#include <string_view>

#include "io/trajectory_evidence.hpp"

namespace ygslam {

/// Decides by a header that names the columns, matrices over several lines, COLMAP's pairs of
/// lines, and else by the evidence of the columns. Nothing is taken on trust: what fits nothing, or
/// two things, is refused.
/// @param text without carriage returns inside lines. @param name for messages.
/// @return kInput naming file, line, what was found and what is accepted.
[[nodiscard]] Result<PoseText> recognise_poses(std::string_view text, const std::string& name);

}  // namespace ygslam
