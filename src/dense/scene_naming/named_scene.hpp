// A dense map read as a scene: what its surfaces are called, and the objects in it. Nothing here
// changes the map.
#pragma once

#include "dense/dense_map.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// All of it: the mesh with floor, walls, tables and objects named, space, objects with their
/// boxes.
[[nodiscard]] StaticScene named_scene(DenseMap& map);
/// The same without what all views' images are unpacked for (labels where things meet): for a map
/// that is looked at again and again while it is made.
[[nodiscard]] StaticScene quick_scene(DenseMap& map);

/// A mesh as it is taken from the map, quickly: what is left to do wants the map no more.
struct NamedMesh {
  TriangleMesh mesh;  ///< objects have their classes, what labelled_mesh() names has none yet
  Vec3 up_guess_world = Vec3::Zero(), cameras_world = Vec3::Zero();  ///< means of the views
};
[[nodiscard]] NamedMesh named_mesh(DenseMap& map);
/// Floor, walls, ceiling and tables named, too, as in named_scene(), but without panels below
/// tables.
[[nodiscard]] TriangleMesh labelled_mesh(NamedMesh named);

}  // namespace ygslam
