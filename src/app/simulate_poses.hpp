// Rendering for a camera that somebody else moves: a robot in a loop with the rendered world.
#pragma once

#include <string>

#include "app/simulation_outputs.hpp"

namespace ygslam {

inline constexpr const char* kStandardInput = "-";

/// A frame for each line of a file, or of standard input as soon as the line is there.
/// @return how many frames; kInput for a line that is no pose or not later than the one before (the
/// frames before it are kept, but no lists of them).
[[nodiscard]] Result<int> render_poses(const std::string& file, sim::SequenceSource& source,
                                       SimulationOutputs& outputs);

}  // namespace ygslam
