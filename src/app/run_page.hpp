// The live page as `ygslam run` was asked for it.
#pragma once

#include "app/run_options.hpp"
#include "live/run_view.hpp"

namespace ygslam {

/// Opens the page of --view and prints its address.
/// @return kUsage of its options; see RunView::start().
[[nodiscard]] Result<std::unique_ptr<RunView>> start_page(const RunOptions& options,
                                                          const CameraConfig& camera);

}  // namespace ygslam
