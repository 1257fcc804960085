// `ygslam inspect SEQ --loops OUT`: what loop closing did in a finished run.
#pragma once

#include "app/inspect_run.hpp"
#include "core/result.hpp"

namespace ygslam {

/// Prints tables or JSON; the sequence's groundtruth.txt, if it has one, is the truth.
/// @return kUsage, kInput: no sequence, no or a damaged loops.csv or groundtruth.txt.
[[nodiscard]] Status inspect_loops(const InspectOptions& options);

}  // namespace ygslam
