// The numbers that people read: in files, on pictures, in the names of meshes.
#pragma once

#include "scene/scene.hpp"

namespace ygslam {

/// Numbers objects from 1 on without a gap, those that are sure before candidates and else in their
/// order, in which they stand afterwards; labels of the mesh and of space name them by their new
/// numbers.
void number_objects(StaticScene& scene);

}  // namespace ygslam
