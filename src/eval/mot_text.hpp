// Tracks as text, a line per box, as MOTChallenge has it:
// frame,id,left,top,width,height,counts,-1,-1,-1 with frames from 1. What other evaluators read.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/result.hpp"
#include "eval/tracking_score.hpp"

namespace ygslam {

/// One of BoxFrame's lists of boxes, frame by frame.
[[nodiscard]] std::string mot_text(std::span<const BoxFrame> frames,
                                   std::vector<IdBox> BoxFrame::*boxes);

/// Truth and tracks of one sequence; as many frames as the longer of the two has.
/// @return kInput naming file, line and fault: no such line, an id twice in a frame.
[[nodiscard]] Result<std::vector<BoxFrame>> read_mot(const std::filesystem::path& truth,
                                                     const std::filesystem::path& tracked);

}  // namespace ygslam
