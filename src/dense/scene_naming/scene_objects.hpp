// Objects with their boxes and states, and what of the mesh is theirs.
#pragma once

#include "dense/object_map.hpp"
#include "scene/scene.hpp"

namespace ygslam {

struct PlacingConfig {
  int min_views = 3;             ///< keyframes that show an object that is no candidate
  double min_probability = 0.1;  ///< of the same: KnownObject::probability()
  double out_of_sight_s = 5;     ///< then it is unobserved
  double moving_s = 2;           ///< since it was seen to move
  double box_share = 0.01;       ///< of the surface left out at either side of a box
  double patch_m = 0.025;        ///< between the points of a surface
  double gap_m = 0.1;  ///< cubes of this side that touch hang together; small parts are none of it
};

/// Labels that name an object are given its class; where it is only a candidate they are taken
/// away.
/// @param mesh, space labelled with the map's objects or such as were merged since.
/// @return in ascending order of ids; each object once, at the place where it was seen last.
[[nodiscard]] std::vector<SceneObject> place_objects(const ObjectMap& objects,
                                                     const Gravity& gravity, TriangleMesh& mesh,
                                                     SpaceCells& space,
                                                     const PlacingConfig& config = {});

/// The same of the mesh alone, without the objects' boxes, which take most of the time.
void name_surfaces(const ObjectMap& objects, TriangleMesh& mesh, const PlacingConfig& config = {});

/// The upright box with the least ground area around the points but for a share of them at either
/// side. @param p_world at least one.
[[nodiscard]] OrientedBox upright_box(std::span<const Vec3> p_world, const Gravity& gravity,
                                      double share_left_out);

}  // namespace ygslam
