#include "app/scene_output.hpp"

#include "core/log.hpp"
#include "scene_file/export_scene.hpp"

namespace ygslam {

Status write_scene(const std::filesystem::path& folder, const StaticScene& scene) {
  if (scene.mesh.triangles.empty())
    log::warn("{}: nothing of the static scene was seen, its files are empty", folder.string());
  return export_scene(
      folder, {scene.mesh.vertices, scene.mesh, scene.space, scene.objects, scene.gravity, {}});
}

}  // namespace ygslam
