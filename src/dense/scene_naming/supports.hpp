// What objects stand on. Masks end above the feet of chairs and screens, and an edge's width above
// the table that a cup stands on.
#pragma once

#include <span>

#include "scene/scene.hpp"

namespace ygslam {

struct SupportConfig {
  double beside_m = 0.1;          ///< of a box: what it stands on is hidden below the object itself
  double reach_of_height = 0.75;  ///< below a box, as a part of its height,
  double least_reach_m = 0.05;    ///< or this, if more
  double above_m = 0.02;          ///< a box that ends so far below it stands on it, too
  double level_m = 0.02;          ///< what lies within is one surface
  double level_cos = 0.85;        ///< least between its normals and up
  double square_m = 0.05;         ///< of the ground below the box and beside it, of which
  double min_share = 0.35;        ///< so many show the surface: else something hidden is nearer
};

/// Boxes of objects, at all their places, reach down to the level surface that they stand on, if
/// one lies close enough below.
void stand_on_supports(const TriangleMesh& mesh, const Gravity& gravity,
                       std::span<SceneObject> objects, const SupportConfig& config = {});

}  // namespace ygslam
