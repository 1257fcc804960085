// What a run wrote, for its last line.
#pragma once

#include <string>

#include "app/run_options.hpp"

namespace ygslam {

/// "written: out, scene (--export), ...". @param has_dense a dense map lies beside --save-map.
/// @param has_background --background was drawn, which an interrupted run does not.
[[nodiscard]] std::string targets_text(const RunOptions& options, bool has_dense,
                                       bool has_background);

}  // namespace ygslam
