#include "dense/tables.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

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

/// Neither of a thing nor of floor and walls.
bool is_free(const SurfacePoint& vertex) {
  return vertex.label.object == kNoSceneObject &&
         vertex.label.semantic_class == SemanticClass::kUnknown;
}

struct Top {
  std::vector<Vec3> points_world;
  double m2 = 0;
};

/// Parts of the mesh that hang together, level and at the height of tables.
std::vector<Top> find_tops(const TriangleMesh& mesh, const Gravity& gravity,
                           const TableConfig& config) {
  const auto is_level = [&](const SurfacePoint& vertex) {
    if (!is_free(vertex) && vertex.label.semantic_class != kTable) return false;
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

/// The top with what bounds it: as thick as a table's top is. @return its vertices.
std::vector<std::uint32_t> name_plate(OrientedBox plate, const SurfaceLabel& label,
                                      const Gravity& gravity, const TableConfig& config,
                                      TriangleMesh& mesh) {
  plate.T_world_box = SE3(plate.T_world_box.R(),
                          plate.T_world_box.t() - 0.5 * config.thickness_m * gravity.up_world);
  plate.size_m.z() += config.thickness_m;
  std::vector<std::uint32_t> named;
  for (std::uint32_t i = 0; i < mesh.vertices.size(); ++i) {
    SurfacePoint& vertex = mesh.vertices[i];
    if (!is_free(vertex) || !is_inside(vertex.p_world.cast<double>(), plate, config.margin_m))
      continue;
    vertex.label = label;
    named.push_back(i);
  }
  return named;
}

/// Legs and sides: what has no name, is between the floor and the top and hangs together with it.
void name_below(const OrientedBox& box, std::span<const std::uint32_t> plate,
                const SurfaceLabel& label, const Gravity& gravity, const TableConfig& config,
                TriangleMesh& mesh) {
  std::vector<bool> is_part(mesh.vertices.size());
  for (std::size_t i = 0; i < is_part.size(); ++i) {
    const Vec3 p_world = mesh.vertices[i].p_world.cast<double>();
    is_part[i] = is_free(mesh.vertices[i]) && is_inside(p_world, box, config.margin_m) &&
                 p_world.dot(gravity.up_world) > gravity.floor_m + config.above_floor_m;
  }
  for (const std::uint32_t i : plate) is_part[i] = true;
  Pieces pieces(mesh.vertices.size());
  for (const auto& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i)
      if (is_part[triangle[i]] && is_part[triangle[(i + 1) % 3]])
        pieces.join(triangle[i], triangle[(i + 1) % 3]);
  std::set<std::uint32_t> roots;
  for (const std::uint32_t i : plate) roots.insert(pieces.root(i));
  for (std::uint32_t i = 0; i < is_part.size(); ++i)
    if (is_part[i] && roots.contains(pieces.root(i))) mesh.vertices[i].label = label;
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
    const SurfaceLabel label{kTable, table.id, table.probability};
    const auto plate_points = name_plate(plate, label, gravity, config, mesh);
    name_below(down_to_floor(plate, gravity), plate_points, label, gravity, config, mesh);
  }
  return tables;
}

}  // namespace ygslam
