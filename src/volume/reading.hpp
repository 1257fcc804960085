// What of a volume is believed, and its space as cells.
#pragma once

#include "scene/scene.hpp"
#include "volume/volume.hpp"

namespace ygslam {

struct ReadingConfig {
  int min_views = 2;               ///< that a voxel or an occupied cell needs to be believed
  double max_through_ratio = 1.0;  ///< views through the place for each that saw a surface there
  int min_triangles = 40;          ///< smaller pieces by themselves are left out; about 20 voxels
  int min_thing_triangles = 8;     ///< the same of pieces that show mostly things: a far bottle
};

/// Every cell that a view observed, but those whose surface fewer views saw than
/// ReadingConfig::min_views: they are unknown. An occupied one has the colour and the label of the
/// voxel in it that is nearest to the surface. Classes are not known here.
[[nodiscard]] SpaceCells space_cells(const Volume& volume, const ReadingConfig& config = {});

}  // namespace ygslam
