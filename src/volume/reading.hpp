// The volume's space as cells.
#pragma once

#include "scene/scene.hpp"
#include "volume/volume.hpp"

namespace ygslam {

/// Every cell that a view observed; an occupied one has the colour and the label of the voxel in
/// it that is nearest to the surface. Classes are not known here.
[[nodiscard]] SpaceCells space_cells(const Volume& volume);

}  // namespace ygslam
