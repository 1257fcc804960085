#include "scene_file/export_scene.hpp"

#include <array>

#include "scene_file/glb.hpp"
#include "scene_file/labelled_cloud.hpp"
#include "scene_file/objects_file.hpp"
#include "scene_file/space_file.hpp"

namespace ygslam {
namespace {

using Path = std::filesystem::path;

Status write_octomaps(const Path& folder, const SceneContent& scene) {
  const Status plain = write_octomap_bt(folder / "space.bt", scene.space);
  return plain.ok() ? write_octomap_ot(folder / "space.ot", scene.space) : plain;
}

Status write_grid(const Path& folder, const SceneContent& scene) {
  const auto grid = make_occupancy_grid(scene.space, scene.gravity, scene.grid);
  if (grid.ok()) return write_occupancy_grid(folder / "grid.yaml", *grid);
  return Error{grid.error().kind, (folder / "grid.pgm").string() + ": " + grid.error().message};
}

Status write_things(const Path& folder, const SceneContent& scene) {
  const Status objects = write_objects(folder / "objects.json", scene.objects, scene.gravity);
  return objects.ok() ? write_labels(folder / "labels.json") : objects;
}

constexpr std::array<SceneFileKind, 7> kKinds{
    {{"ply", "cloud.ply", "labelled points, for CloudCompare, MeshLab, Open3D",
      [](const Path& folder, const SceneContent& scene) {
        return write_labelled_ply(folder / "cloud.ply", scene.cloud);
      }},
     {"pcd", "cloud.pcd", "labelled points, for PCL",
      [](const Path& folder, const SceneContent& scene) {
        return write_pcd(folder / "cloud.pcd", scene.cloud);
      }},
     {"mesh", "mesh.ply", "labelled triangles",
      [](const Path& folder, const SceneContent& scene) {
        return write_mesh_ply(folder / "mesh.ply", scene.mesh);
      }},
     {"glb", "mesh.glb", "triangles with a node for each object, for Blender and viewers",
      [](const Path& folder, const SceneContent& scene) {
        return write_glb(folder / "mesh.glb", scene.mesh, scene.objects, scene.gravity);
      }},
     {"octomap", "space.bt space.ot", "free and occupied space, for planners", write_octomaps},
     {"grid", "grid.pgm grid.yaml", "ground plan, for ROS' map_server", write_grid},
     {"objects", "objects.json labels.json", "things with class, box and state", write_things}}};

}  // namespace

std::span<const SceneFileKind> scene_file_kinds() { return kKinds; }

Status export_scene(const Path& folder, const SceneContent& scene) {
  for (const SceneFileKind& kind : kKinds) {
    if (Status written = kind.write(folder, scene); !written.ok()) return written;
  }
  return Ok{};
}

}  // namespace ygslam
