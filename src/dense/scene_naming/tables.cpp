#include "dense/scene_naming/tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "dense/scene_naming/room_structure.hpp"
#include "dense/scene_naming/scene_objects.hpp"
#include "scene/floor_frame.hpp"
#include "volume/mesh_pieces.hpp"

namespace ygslam {
namespace {

constexpr SemanticClass kTable = coco_class(60);  // COCO calls every table a dining table
constexpr double kTopCos = 0.9;
constexpr double kGround_m = 0.05;  // side of a square of the ground
constexpr double kBoxShare = 0.01;  // of a top left out at either side of its box

/// A box that knows which points lie in it, or so near it.
class Inside {
 public:
  Inside(const OrientedBox& box, double margin_m)
      : T_box_world_(box.T_world_box.inverse()),
        half_m_(0.5 * box.size_m + Vec3::Constant(margin_m)) {}
  [[nodiscard]] bool operator()(const Vec3& p_world) const {
    return ((T_box_world_ * p_world).cwiseAbs().array() <= half_m_.array()).all();
  }

 private:
  SE3 T_box_world_;
  Vec3 half_m_;
};

bool stands_there(const SceneObject& object) {
  return object.state == ObjectState::kStatic || object.state == ObjectState::kSettled ||
         object.state == ObjectState::kUnobserved;
}

struct Top {
  std::vector<Vec3> points_world;
  std::size_t named = 0;  // how many of them masks call a table, whichever: desks share a top
  double m2 = 0;
  double height_m = 0;  // mean, above the floor
};

Eigen::Vector2d sides_m(const Top& top, const Gravity& gravity) {
  return upright_box(top.points_world, gravity, kBoxShare).size_m.head<2>();
}

/// As large as a table and too narrow for one.
bool is_sill(const Top& top, const Gravity& gravity, const TableConfig& config) {
  return top.m2 >= config.min_m2 && sides_m(top, gravity).minCoeff() < config.min_width_m;
}

/// Large, wide and whole enough.
bool is_table(const Top& top, const Gravity& gravity, const TableConfig& config) {
  if (top.m2 < config.min_m2) return false;
  const Eigen::Vector2d sides = sides_m(top, gravity);
  return sides.minCoeff() >= config.min_width_m && top.m2 >= config.min_seen_share * sides.prod();
}

/// What a top covers of the floor, in squares of a grid.
struct Ground {
  std::set<std::array<int, 2>> squares;
  Eigen::AlignedBox2d extent;  // of their corners of least x and y [squares]
};

Ground ground_of(const Top& top, const SE3& T_floor_world) {
  Ground ground;
  for (const Vec3& p_world : top.points_world) {
    const Eigen::Vector2d at =
        ((T_floor_world * p_world).head<2>() / kGround_m).array().floor().matrix();
    ground.squares.insert({static_cast<int>(at.x()), static_cast<int>(at.y())});
    ground.extent.extend(at);
  }
  return ground;
}

/// From one to the other, as far as that is at most a reach; else infinite.
double way_m(const Ground& a, const Ground& b, double reach_m) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const int reach = static_cast<int>(reach_m / kGround_m);
  if (a.extent.exteriorDistance(b.extent) > 2 * reach) return kFar;
  if (a.squares.size() > b.squares.size()) return way_m(b, a, reach_m);
  int least = reach + 1;
  for (const auto& [x, y] : a.squares) {
    if (b.extent.exteriorDistance(Eigen::Vector2d(x, y)) > 2 * reach) continue;
    if (least <= 1) break;  // beside it
    for (int dy = -reach; dy <= reach; ++dy)
      for (int dx = -reach; dx <= reach; ++dx)
        if (const int way = std::max(std::abs(dx), std::abs(dy));
            way < least && b.squares.contains({x + dx, y + dy}))
          least = way;
  }
  return least > reach ? kFar : least * kGround_m;
}

/// What stands on a top hides strips of it, which parts it.
class TopParts {
 public:
  TopParts(std::vector<Top> parts, const Gravity& gravity, const TableConfig& config)
      : tops_(std::move(parts)), groups_(tops_.size()), gravity_(gravity), config_(config) {
    const SE3 T_floor_world = T_world_floor(gravity).inverse();
    std::vector<Ground> grounds;
    for (const Top& part : tops_) grounds.push_back(ground_of(part, T_floor_world));
    for (std::uint32_t a = 0; a < tops_.size(); ++a) {
      for (std::uint32_t b = a + 1; b < tops_.size(); ++b) {
        if (!are_level(tops_[a], tops_[b])) continue;
        if (const double m = way_m(grounds[a], grounds[b], config.max_hidden_m); std::isfinite(m))
          gaps_.push_back({m, a, b});
      }
    }
    std::sort(gaps_.begin(), gaps_.end(), [](const Gap& x, const Gap& y) {
      return std::tie(x.m, x.a, x.b) < std::tie(y.m, y.a, y.b);
    });
  }

  /// Parts of one height that are near each other are of one top, the nearest first; but two that
  /// are each large enough for a table stay two, and a part that is large and narrow is a sill.
  [[nodiscard]] std::vector<Top> joined() && {
    std::vector<bool> are_sills;  // small parts are none, however narrow their sum is
    for (const Top& top : tops_) are_sills.push_back(is_sill(top, gravity_, config_));
    for (const Gap& gap : gaps_) {
      const std::uint32_t a = groups_.root(gap.a), b = groups_.root(gap.b);
      if (a == b || are_sills[a] || are_sills[b] || !are_level(tops_[a], tops_[b])) continue;
      if (std::min(tops_[a].m2, tops_[b].m2) < config_.min_m2) join(a, b);
    }
    std::vector<Top> roots;
    for (std::uint32_t i = 0; i < tops_.size(); ++i)
      if (groups_.root(i) == i) roots.push_back(std::move(tops_[i]));
    return roots;
  }

 private:
  struct Gap {
    double m = 0;
    std::uint32_t a = 0, b = 0;
  };

  [[nodiscard]] bool are_level(const Top& a, const Top& b) const {
    return std::abs(a.height_m - b.height_m) <= config_.margin_m;
  }

  void join(std::uint32_t a, std::uint32_t b) {
    groups_.join(a, b);
    const std::uint32_t root = groups_.root(a);
    tops_[root] = sum(std::move(tops_[root]), tops_[root == a ? b : a]);
    tops_[root == a ? b : a] = {};
  }

  [[nodiscard]] static Top sum(Top all, const Top& other) {
    all.height_m = (all.m2 * all.height_m + other.m2 * other.height_m) / (all.m2 + other.m2);
    all.m2 += other.m2;
    all.points_world.insert(all.points_world.end(), other.points_world.begin(),
                            other.points_world.end());
    all.named += other.named;
    return all;
  }

  std::vector<Top> tops_;  // a group's is at its root
  Pieces groups_;
  const Gravity& gravity_;
  const TableConfig& config_;
  std::vector<Gap> gaps_;
};

/// What is level and at the height of tables, large and wide enough for one.
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
    if (mesh.vertices[i].label.object != kNoSceneObject) ++top.named;
    top.m2 += areas_m2[i];
  }
  std::vector<Top> parts;
  for (auto& [root, top] : tops) {
    if (top.m2 < config.least_part_m2) continue;
    for (const Vec3& p_world : top.points_world)
      top.height_m += (p_world.dot(gravity.up_world) - gravity.floor_m) /
                      static_cast<double>(top.points_world.size());
    parts.push_back(std::move(top));
  }
  parts = TopParts(std::move(parts), gravity, config).joined();
  std::erase_if(parts, [&](const Top& top) { return !is_table(top, gravity, config); });
  return parts;
}

/// The named table that the top is of; nullptr if none is.
const SceneObject* named_table(const Top& top, std::span<const SceneObject> objects,
                               const TableConfig& config) {
  for (const SceneObject& object : objects) {
    if (object.semantic_class != kTable || !stands_there(object)) continue;
    const auto inside = std::count_if(top.points_world.begin(), top.points_world.end(),
                                      Inside(object.box, config.thickness_m));
    if (static_cast<double>(inside) >=
        config.min_share_in * static_cast<double>(top.points_world.size()))
      return &object;
  }
  return nullptr;
}

/// Whether masks show all of it: then they say what on it is none of it, too.
bool is_shown_whole(const Top& top, const TableConfig& config) {
  return static_cast<double>(top.named) >=
         config.whole_share * static_cast<double>(top.points_world.size());
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

/// The plate with what bounds it: as thick as a table's top is.
void name_plate(OrientedBox plate, const SurfaceLabel& label, const Gravity& gravity,
                const TableConfig& config, TriangleMesh& mesh) {
  plate.T_world_box = SE3(plate.T_world_box.R(),
                          plate.T_world_box.t() - 0.5 * config.thickness_m * gravity.up_world);
  plate.size_m.z() += config.thickness_m;
  const Inside inside(plate, config.margin_m);
  for (SurfacePoint& vertex : mesh.vertices)
    if (vertex.label.object == kNoSceneObject && inside(vertex.p_world.cast<double>()))
      vertex.label = label;
}

}  // namespace

std::vector<SceneObject> find_tables(TriangleMesh& mesh, const Gravity& gravity,
                                     std::span<const SceneObject> objects, const SpaceCells& space,
                                     const TableConfig& config) {
  std::vector<SceneObject> tables;
  std::vector<std::pair<OrientedBox, SurfaceLabel>> plates;
  for (const Top& top : find_tops(mesh, gravity, config)) {
    const OrientedBox plate = upright_box(top.points_world, gravity, kBoxShare);
    SceneObject table;
    const SceneObject* named = named_table(top, objects, config);
    if (named != nullptr) {
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
    plates.emplace_back(plate, SurfaceLabel{kTable, table.id, table.probability});
    if (named == nullptr || !is_shown_whole(top, config))
      name_plate(plate, plates.back().second, gravity, config, mesh);
  }
  // Tables stand side by side: what is right under a top first, then what is beside it.
  TableLegsConfig right_under = config.legs;
  right_under.panel_beside_m = right_under.leg_beside_m = config.margin_m;
  for (const TableLegsConfig& legs : {right_under, config.legs})
    for (const auto& [plate, label] : plates)
      name_under_top(plate, label, gravity, space, legs, mesh);
  return tables;
}

}  // namespace ygslam
