// A dense map read as a scene: what its surfaces are called, and the objects in it. Nothing here
// changes the map.
#pragma once

#include <optional>

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
/// Of a mesh with triangles.
[[nodiscard]] Gravity gravity_of(const NamedMesh& named);
/// Floor, walls, ceiling and tables named, too, as in named_scene(), but without panels below
/// tables.
[[nodiscard]] TriangleMesh labelled_mesh(NamedMesh named, const Gravity& gravity);
[[nodiscard]] TriangleMesh labelled_mesh(NamedMesh named);

/// The ground plan as it is now. The floor is looked for from time to time, when there are more
/// views than the last time. @param given its place, in place of one that is found.
/// @return empty as long as no floor is known.
[[nodiscard]] GroundGrid live_plan(DenseMap& map, const std::optional<Gravity>& given = {});

}  // namespace ygslam
