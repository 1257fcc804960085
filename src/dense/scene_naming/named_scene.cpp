#include "dense/scene_naming/named_scene.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "dense/scene_naming/edge_labels.hpp"
#include "dense/scene_naming/object_numbers.hpp"
#include "dense/scene_naming/room_structure.hpp"
#include "dense/scene_naming/scene_objects.hpp"
#include "dense/scene_naming/supports.hpp"
#include "dense/scene_naming/tables.hpp"
#include "volume/reading.hpp"

namespace ygslam {
namespace {

using PlacedViews = std::vector<DenseMap::PlacedView>;

struct MeanCamera {
  Vec3 up_guess_world = Vec3::Zero(), p_world = Vec3::Zero();
};
MeanCamera mean_camera(const PlacedViews& views) {
  MeanCamera mean;
  for (const DenseMap::PlacedView& view : views) {
    mean.up_guess_world -= view.T_world_camera.R().col(1);  // of a camera: y is down
    mean.p_world += view.T_world_camera.t();
  }
  if (!views.empty()) mean.p_world /= static_cast<int>(views.size());
  return mean;
}

/// What vertices show where labels meet, by the pixels of all views.
void label_edges(DenseMap& map, const PlacedViews& views, TriangleMesh& mesh) {
  EdgeLabels edges(mesh, map.config().volume.preparation);
  if (edges.empty()) return;
  for (const DenseMap::PlacedView& view : views)
    edges.add_votes(map.images(view), view.T_world_camera);
  edges.write_labels(mesh);
}

/// Fills in the views that look at a table, whether something hides it or not.
void count_views(const DenseMap& map, const PlacedViews& views, SceneObject& table) {
  const double farthest_m = map.config().volume.preparation.max_depth_m;
  const Vec3 top_world = table.box.T_world_box * Vec3(0, 0, 0.5 * table.box.size_m.z());
  std::optional<Timestamp> first, last;
  for (const DenseMap::PlacedView& view : views) {
    const Vec3 p_camera = view.T_world_camera.inverse() * top_world;
    if (p_camera.z() <= 0 || p_camera.z() > farthest_m) continue;
    if (!map.camera().contains(map.camera().project(p_camera))) continue;
    ++table.views;
    first = std::min(first.value_or(view.stamp), view.stamp);
    last = std::max(last.value_or(view.stamp), view.stamp);
  }
  table.first_seen = first.value_or(map.objects().now());
  table.last_seen = last.value_or(map.objects().now());
  table.known = table.first_seen;
}

enum class Edges { kAsFused, kByAllViews };

StaticScene read_scene(DenseMap& map, Edges edges) {
  StaticScene scene{map.mesh(), space_cells(map.volume(), map.config().reading), {}, {}};
  const PlacedViews views = map.views();
  if (views.empty()) return scene;
  if (edges == Edges::kByAllViews) label_edges(map, views, scene.mesh);
  const MeanCamera mean = mean_camera(views);
  scene.gravity = find_gravity(scene.mesh, mean.up_guess_world, mean.p_world);
  scene.objects = place_objects(map.objects(), scene.gravity, scene.mesh, scene.space);
  for (SceneObject& table : find_tables(scene.mesh, scene.gravity, scene.objects, scene.space)) {
    count_views(map, views, table);
    scene.objects.push_back(std::move(table));
  }
  stand_on_supports(scene.mesh, scene.gravity, scene.objects);
  label_structure(scene.mesh, scene.gravity);
  label_cells(scene.mesh, scene.space);
  number_objects(scene);
  return scene;
}

}  // namespace

StaticScene named_scene(DenseMap& map) { return read_scene(map, Edges::kByAllViews); }
StaticScene quick_scene(DenseMap& map) { return read_scene(map, Edges::kAsFused); }

NamedMesh named_mesh(DenseMap& map) {
  const PlacedViews views = map.views();
  if (views.empty()) return {};
  const MeanCamera mean = mean_camera(views);
  NamedMesh named{map.mesh(), mean.up_guess_world, mean.p_world};
  name_surfaces(map.objects(), named.mesh);
  return named;
}

Gravity gravity_of(const NamedMesh& named) {
  return find_gravity(named.mesh, named.up_guess_world, named.cameras_world);
}

TriangleMesh labelled_mesh(NamedMesh named, const Gravity& gravity) {
  static_cast<void>(find_tables(named.mesh, gravity, {}, {}));  // no panels
  label_structure(named.mesh, gravity);
  return std::move(named.mesh);
}

TriangleMesh labelled_mesh(NamedMesh named) {
  if (named.mesh.triangles.empty()) return std::move(named.mesh);
  const Gravity gravity = gravity_of(named);
  return labelled_mesh(std::move(named), gravity);
}

GroundGrid live_plan(DenseMap& map, const std::optional<Gravity>& given) {
  if (given) {
    map.plan().set_floor(*given);
  } else if (map.wants_floor()) {
    const MeanCamera mean = mean_camera(map.views());
    map.set_floor(find_gravity(map.mesh(), mean.up_guess_world, mean.p_world));
  }
  return map.plan().grid();
}

}  // namespace ygslam
