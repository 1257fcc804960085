#include "app/scene_input.hpp"

#include "core/statistics.hpp"
#include "scene_file/read_objects.hpp"
#include "scene_file/read_surface.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;

Result<fs::path> surface_file(const fs::path& path) {
  std::error_code code;
  if (!fs::is_directory(path, code)) return path;
  for (const char* name : {"mesh.ply", "cloud.ply", "map.ply"})
    if (fs::exists(path / name, code)) return path / name;
  return Error{ErrorKind::kInput, path.string() + ": has no mesh.ply, cloud.ply or map.ply"};
}

Gravity gravity_of(const TriangleMesh& mesh) {
  Vec3 sum = Vec3::Zero();
  for (const SurfacePoint& point : mesh.vertices)
    if (point.label.semantic_class == SemanticClass::kFloor)
      sum += point.normal_world.cast<double>();
  const bool has_floor = sum.norm() > 0;
  const Vec3 up_world = has_floor ? sum.normalized() : Vec3(0, -1, 0);
  return {up_world, lowest_height(mesh, up_world), has_floor};
}

}  // namespace

double lowest_height(const TriangleMesh& mesh, const Vec3& up_world) {
  constexpr double kStrayShare = 0.005;
  std::vector<double> heights;
  heights.reserve(mesh.vertices.size());
  for (const SurfacePoint& point : mesh.vertices)
    heights.push_back(point.p_world.cast<double>().dot(up_world));
  return heights.empty() ? 0 : quantile(heights, kStrayShare);
}

Result<SceneInput> read_scene_input(const fs::path& path) {
  const auto file = surface_file(path);
  if (!file.ok()) return file.error();
  auto mesh = read_surface_ply(*file);
  if (!mesh.ok()) return mesh.error();
  SceneInput scene{std::move(*mesh), {}, {}, false};
  const fs::path beside = file->parent_path() / "objects.json";
  std::error_code code;
  if (fs::exists(beside, code)) {
    auto known = read_objects(beside);
    if (!known.ok()) return known.error();
    scene.objects = std::move(known->objects);
    scene.has_objects = true;
    scene.gravity = known->gravity;
    scene.gravity.has_floor = true;
  } else {
    scene.gravity = gravity_of(scene.mesh);
  }
  return scene;
}

}  // namespace ygslam
