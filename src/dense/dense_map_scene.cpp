// What a dense map is read as: its mesh with names, its scene.
#include <algorithm>
#include <optional>
#include <utility>

#include "dense/dense_map.hpp"
#include "dense/edge_labels.hpp"
#include "dense/room_structure.hpp"
#include "dense/scene_objects.hpp"
#include "dense/supports.hpp"
#include "dense/tables.hpp"
#include "volume/reading.hpp"

namespace ygslam {

std::vector<ColouredPoint> coloured_points(const TriangleMesh& mesh) {
  std::vector<ColouredPoint> points;
  points.reserve(mesh.vertices.size());
  for (const SurfacePoint& vertex : mesh.vertices)
    points.push_back({vertex.p_world, vertex.colour});
  return points;
}

TriangleMesh labelled_mesh(NamedMesh named) {
  if (!named.mesh.triangles.empty()) {
    const Gravity gravity = find_gravity(named.mesh, named.up_guess_world, named.cameras_world);
    static_cast<void>(find_tables(named.mesh, gravity, {}, {}));  // no panels, no joined strips
    label_structure(named.mesh, gravity);
  }
  return std::move(named.mesh);
}

int DenseMap::mean_camera(Vec3& up_guess_world, Vec3& place_world) const {
  up_guess_world = place_world = Vec3::Zero();
  int views = 0;
  for (const auto& [id, contribution] : contributions_) {
    if (!contribution.fused) continue;
    up_guess_world -= contribution.fused->R().col(1);  // of a camera: y is down
    place_world += contribution.fused->t();
    ++views;
  }
  if (views > 0) place_world /= views;
  return views;
}

NamedMesh DenseMap::named_mesh() {
  NamedMesh named{mesh()};
  name_surfaces(objects_, named.mesh);
  if (mean_camera(named.up_guess_world, named.cameras_world) == 0) named.mesh = {};
  return named;
}

StaticScene DenseMap::scene() {
  StaticScene scene{mesh(), space_cells(volume_, config_.reading), {}, {}};
  Vec3 up, place;
  if (mean_camera(up, place) == 0) return scene;
  label_edges(scene.mesh);
  scene.gravity = find_gravity(scene.mesh, up, place);
  scene.objects = place_objects(objects_, scene.gravity, scene.mesh, scene.space);
  add_tables(scene);
  stand_on_supports(scene.mesh, scene.gravity, scene.objects);
  label_structure(scene.mesh, scene.gravity);
  label_cells(scene.mesh, scene.space);
  return scene;
}

void DenseMap::label_edges(TriangleMesh& mesh) {
  EdgeLabels edges(mesh, config_.volume.preparation);
  if (edges.empty()) return;
  for (const auto& [id, contribution] : contributions_) {
    if (!contribution.fused) continue;
    const SE3& T_world_camera = *contribution.fused;
    edges.add_votes(view_of(contribution, contribution.fused_state, T_world_camera),
                    T_world_camera);
  }
  edges.write_labels(mesh);
}

void DenseMap::add_tables(StaticScene& scene) const {
  const double farthest_m = config_.volume.preparation.max_depth_m;
  for (SceneObject& table : find_tables(scene.mesh, scene.gravity, scene.objects, scene.space)) {
    const Vec3 top_world = table.box.T_world_box * Vec3(0, 0, 0.5 * table.box.size_m.z());
    std::optional<Timestamp> first, last;
    for (const auto& [id, contribution] : contributions_) {
      if (!contribution.fused) continue;
      const Vec3 p_camera = contribution.fused->inverse() * top_world;
      if (p_camera.z() <= 0 || p_camera.z() > farthest_m) continue;
      if (!camera_.contains(camera_.project(p_camera))) continue;
      ++table.views;
      first = std::min(first.value_or(contribution.stamp), contribution.stamp);
      last = std::max(last.value_or(contribution.stamp), contribution.stamp);
    }
    table.first_seen = first.value_or(objects_.now());
    table.last_seen = last.value_or(objects_.now());
    table.known = table.first_seen;
    scene.objects.push_back(std::move(table));
  }
}

}  // namespace ygslam
