// A surface from files, with what lies beside it.
#pragma once

#include <filesystem>
#include <vector>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

struct SceneInput {
  TriangleMesh mesh;  ///< without triangles: a cloud
  std::vector<SceneObject> objects;
  Gravity gravity;           ///< has_floor: of objects.json, or of what is labelled floor
  bool has_objects = false;  ///< an objects.json told of them, be it of none
};

/// @param path a PLY file, or a folder: its mesh.ply, else cloud.ply, else map.ply. Objects and
/// gravity are those of objects.json beside it; without it up is the mean normal of what is
/// labelled floor, else -y (a level camera's), and the floor the lowest that is not stray.
/// @return kInput naming the file.
[[nodiscard]] Result<SceneInput> read_scene_input(const std::filesystem::path& path);

/// The height of the lowest points along `up_world`, strays left out [m]; 0 without points.
[[nodiscard]] double lowest_height(const TriangleMesh& mesh, const Vec3& up_world);

}  // namespace ygslam
