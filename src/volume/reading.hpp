// The volume's space as cells.
#pragma once

#include "scene/scene.hpp"
#include "volume/mesher.hpp"

namespace ygslam {

/// Every cell that a view observed, but those whose surface fewer views saw than
/// ReadingConfig::min_views: they are unknown. An occupied one has the colour and the label of the
/// voxel in it that is nearest to the surface. Classes are not known here.
[[nodiscard]] SpaceCells space_cells(const Volume& volume, const ReadingConfig& config = {});

}  // namespace ygslam
