// Questions to observed space. Each cell is found by halving, as they lie in order.
#pragma once

#include "scene/scene.hpp"

namespace ygslam {

[[nodiscard]] SpaceState state_at(const SpaceCells& space, const Vec3& p_world);

/// Of all cells that the box touches: occupied if one is, else unknown if one is.
/// @param low, high its corners, low nowhere above high.
[[nodiscard]] SpaceState state_of_box(const SpaceCells& space, const Vec3& low, const Vec3& high);

struct SpaceRay {
  Vec3 from_world;
  Vec3 direction_world;  ///< unit length
  double length_m = 0;
  bool past_unknown = false;  ///< only what is occupied ends it
};
struct SpaceHit {
  SpaceState what = SpaceState::kFree;  ///< kFree: nothing ended it
  double distance_m = 0;                ///< to where it enters that cell, else its length
};
/// Cell by cell (Amanatides & Woo 1987, "A fast voxel traversal algorithm for ray tracing").
[[nodiscard]] SpaceHit cast_ray(const SpaceCells& space, const SpaceRay& ray);

}  // namespace ygslam
