#include "dense/tables.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "dense/room_structure.hpp"
#include "dense/scene_objects.hpp"
#include "scene/floor_frame.hpp"
#include "volume/mesh_pieces.hpp"

namespace ygslam {
namespace {

constexpr SemanticClass kTable = coco_class(60);  // COCO calls every table a dining table
constexpr double kTopCos = 0.9;
constexpr double kBoxShare = 0.01;  // of a top left out at either side of its box

bool is_inside(const Vec3& p_world, const OrientedBox& box, double margin_m) {
  const Vec3 p_box = box.T_world_box.inverse() * p_world;
  return ((p_box.cwiseAbs() - 0.5 * box.size_m).array() <= margin_m).all();
}

bool stands_there(const SceneObject& object) {
  return object.state == ObjectState::kStatic || object.state == ObjectState::kSettled ||
         object.state == ObjectState::kUnobserved;
}

struct Top {
  std::vector<Vec3> points_world;
  double m2 = 0;
};

/// Parts of the mesh that hang together, level and at the height of tables.
std::vector<Top> find_tops(const TriangleMesh& mesh, const Gravity& gravity,
                           const TableConfig& config) {
  const auto is_level = [&](const SurfacePoint& vertex) {
    const SurfaceLabel& label = vertex.label;
    if (label.object != kNoSceneObject && label.semantic_class != kTable) return false;
    const double height_m = vertex.p_world.cast<double>().dot(gravity.up_world) - gravity.floor_m;
    return height_m >= config.low_m && height_m <= config.high_m &&
           vertex.normal_world.cast<double>().dot(gravity.up_world) > kTopCos;
  };
  std::vector<bool> level(mesh.vertices.size());
  std::transform(mesh.vertices.begin(), mesh.vertices.end(), level.begin(), is_level);
  Pieces pieces(mesh.vertices.size());
  for (const auto& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i)
      if (level[triangle[i]] && level[triangle[(i + 1) % 3]])
        pieces.join(triangle[i], triangle[(i + 1) % 3]);
  const std::vector<double> areas_m2 = vertex_areas_m2(mesh);
  std::map<std::uint32_t, Top> tops;
  for (std::uint32_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!level[i]) continue;
    Top& top = tops[pieces.root(i)];
    top.points_world.push_back(mesh.vertices[i].p_world.cast<double>());
    top.m2 += areas_m2[i];
  }
  std::vector<Top> large;
  for (auto& [root, top] : tops)
    if (top.m2 >= config.min_m2) large.push_back(std::move(top));
  return large;
}

/// The named table that the top is of; nullptr if none is.
const SceneObject* named_table(const Top& top, std::span<const SceneObject> objects,
                               const TableConfig& config) {
  for (const SceneObject& object : objects) {
    if (object.semantic_class != kTable || !stands_there(object)) continue;
    const auto inside =
        std::count_if(top.points_world.begin(), top.points_world.end(),
                      [&](const Vec3& p) { return is_inside(p, object.box, config.thickness_m); });
    if (static_cast<double>(inside) >=
        config.min_share_in * static_cast<double>(top.points_world.size()))
      return &object;
  }
  return nullptr;
}

/// From the top down to the floor.
OrientedBox down_to_floor(const OrientedBox& top, const Gravity& gravity) {
  const SE3 world_from_floor = T_world_floor(gravity);
  Vec3 middle_floor = world_from_floor.inverse() * top.T_world_box.t();
  const double height_m = middle_floor.z() + 0.5 * top.size_m.z();
  middle_floor.z() = 0.5 * height_m;
  return {SE3(top.T_world_box.R(), world_from_floor * middle_floor),
          Vec3(top.size_m.x(), top.size_m.y(), height_m)};
}

}  // namespace

std::vector<SceneObject> find_tables(TriangleMesh& mesh, const Gravity& gravity,
                                     std::span<const SceneObject> objects,
                                     const TableConfig& config) {
  std::vector<SceneObject> tables;
  for (const Top& top : find_tops(mesh, gravity, config)) {
    OrientedBox plate = upright_box(top.points_world, gravity, kBoxShare);
    if (std::min(plate.size_m.x(), plate.size_m.y()) < config.min_width_m) continue;
    SceneObject table;
    if (const SceneObject* named = named_table(top, objects, config)) {
      table = *named;
    } else {
      table.id = SceneObjectId{
          static_cast<std::uint16_t>(static_cast<std::size_t>(kFirstTable) - tables.size())};
      table.semantic_class = kTable;
      table.probability = config.probability;
      table.state = ObjectState::kStatic;
      table.box = down_to_floor(plate, gravity);
      tables.push_back(table);
    }
    // The plate with what bounds it: as thick as a table's top is.
    plate.T_world_box = SE3(plate.T_world_box.R(),
                            plate.T_world_box.t() - 0.5 * config.thickness_m * gravity.up_world);
    plate.size_m.z() += config.thickness_m;
    for (SurfacePoint& vertex : mesh.vertices)
      if (vertex.label.object == kNoSceneObject &&
          is_inside(vertex.p_world.cast<double>(), plate, config.margin_m))
        vertex.label = {kTable, table.id, table.probability};
  }
  return tables;
}

}  // namespace ygslam
