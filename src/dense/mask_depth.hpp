// Where a mask reaches over the edge of its object, depth tells.
#pragma once

#include "volume/depth_view.hpp"
#include "volume/prepared_view.hpp"

namespace ygslam {

/// A mask is said to show the largest surface in it that hangs together, and what else in it lies
/// no nearer and no farther than that; smaller parts that do become DepthView::kUnsure.
void drop_what_lies_elsewhere(DepthView& view, const PreparationConfig& config);

}  // namespace ygslam
