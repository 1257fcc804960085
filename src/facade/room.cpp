#include "facade/room.hpp"

#include <algorithm>
#include <cmath>

#include "dense/scene_naming/named_scene.hpp"
#include "facade/convert.hpp"
#include "facade/settings.hpp"
#include "scene/floor_frame.hpp"
#include "scene/space_query.hpp"
#include "scene_file/objects_file.hpp"
#include "scene_file/occupancy_grid.hpp"

namespace ygslam::api {
namespace {

constexpr double kFarthest_m = 1000;
constexpr double kMostCells = 1e8;
constexpr std::size_t kMostGrids = 8;  // of other heights, kept

[[noreturn]] void refuse(const char* what) { fail({ErrorKind::kInput, what}); }

Vec3 to_vec3(const std::array<double, 3>& p, const char* name) {
  if (!is_finite(p)) fail({ErrorKind::kInput, std::string(name) + ": finite numbers are expected"});
  const Vec3 v(p[0], p[1], p[2]);
  constexpr double kEnd_m = 1e5;  // of where cells can be
  return v.cwiseMax(-kEnd_m).cwiseMin(kEnd_m);
}

Space to_api(SpaceState state) {
  return state == SpaceState::kFree       ? Space::kFree
         : state == SpaceState::kOccupied ? Space::kOccupied
                                          : Space::kUnknown;
}

Mesh to_api(const TriangleMesh& mesh) {
  std::vector<MapPoint> vertices;
  std::vector<std::array<float, 3>> normals;
  vertices.reserve(mesh.vertices.size());
  normals.reserve(mesh.vertices.size());
  for (const SurfacePoint& v : mesh.vertices) {
    const auto &p = v.p_world, &n = v.normal_world;
    vertices.push_back({p.x(), p.y(), p.z(), v.colour.r, v.colour.g, v.colour.b});
    normals.push_back({n.x(), n.y(), n.z()});
  }
  return {SharedList(std::move(vertices)), SharedList(std::move(normals)),
          SharedList(mesh.triangles)};
}

StaticObject to_api(const SceneObject& o) {
  return {static_cast<int>(o.id),
          semantic_class_name(o.semantic_class),
          o.probability,
          object_state_name(o.state),
          api::to_api(o.box.T_world_box),
          api::to_api(o.box.size_m),
          o.views,
          o.first_seen.ns,
          o.last_seen.ns};
}

/// Rows from the smallest y on, values as nav_msgs has them.
OccupancyGrid to_api(const ygslam::OccupancyGrid& from) {
  OccupancyGrid grid;
  grid.width = from.shades.width();
  grid.height = from.shades.height();
  grid.resolution_m = from.resolution_m;
  grid.origin_m = {from.origin_floor.x(), from.origin_floor.y()};
  grid.T_world_floor = api::to_api(from.T_world_floor);
  grid.cells.reserve(from.shades.size());
  for (int v = grid.height; v-- > 0;)
    for (int u = 0; u < grid.width; ++u) {
      const std::uint8_t shade = from.shades.at(u, v);
      grid.cells.push_back(shade == kGridOccupied ? std::int8_t{100}
                           : shade == kGridFree   ? std::int8_t{0}
                                                  : std::int8_t{-1});
    }
  return grid;
}

OccupancyGrid make_grid(const Room::Impl& room, const Room::Impl::Band& heights_m) {
  GridOptions options;
  options.obstacle_min_m = heights_m.first;
  options.obstacle_max_m = heights_m.second;
  const auto grid = make_occupancy_grid(room.space, room.gravity, options);
  if (!grid.ok()) fail({ErrorKind::kInput, grid.error().message});
  return to_api(*grid);
}

}  // namespace

std::shared_ptr<const Room::Impl> make_room(DenseMap& map) {
  Timestamp newest;
  for (const DenseMap::PlacedView& view : map.views()) newest = std::max(newest, view.stamp);
  return make_room(quick_scene(map), newest.ns);
}

std::shared_ptr<const OccupancyGrid> make_plan(DenseMap& map, const std::optional<Gravity>& floor) {
  const GroundGrid from = live_plan(map, floor);
  auto plan = std::make_shared<OccupancyGrid>();
  plan->t_ns = map.planned().ns;
  plan->width = from.width;
  plan->height = from.height;
  plan->resolution_m = map.config().volume.space.cell_m;
  plan->origin_m = {from.origin_floor.x(), from.origin_floor.y()};
  plan->T_world_floor = api::to_api(from.T_world_floor);
  plan->cells.reserve(from.cells.size());
  for (const GroundState state : from.cells) plan->cells.push_back(static_cast<std::int8_t>(state));
  return plan;
}

std::shared_ptr<const Room::Impl> make_room(StaticScene scene, std::int64_t t_ns) {
  auto room = std::make_shared<Room::Impl>();
  room->t_ns = t_ns;
  room->mesh = to_api(scene.mesh);
  for (const SceneObject& object : scene.objects) room->objects.push_back(to_api(object));
  room->space = std::move(scene.space);
  room->gravity = scene.gravity;
  const GridOptions usual;
  const Room::Impl::Band heights_m{usual.obstacle_min_m, usual.obstacle_max_m};
  // One too large is refused when it is asked for.
  if (auto grid = make_occupancy_grid(room->space, room->gravity, usual); grid.ok())
    room->grids.emplace(heights_m, to_api(*grid));
  for (auto& [unused, grid] : room->grids) grid.t_ns = t_ns;
  return room;
}

Room::Room() : impl_(make_room(StaticScene{}, 0)) {}
Room::Room(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

std::int64_t Room::t_ns() const { return impl_->t_ns; }
const Mesh& Room::mesh() const { return impl_->mesh; }
const std::vector<StaticObject>& Room::objects() const { return impl_->objects; }
std::array<double, 3> Room::up_world() const { return api::to_api(impl_->gravity.up_world); }
double Room::floor_m() const { return impl_->gravity.floor_m; }
Pose Room::T_world_floor() const { return api::to_api(ygslam::T_world_floor(impl_->gravity)); }
double Room::cell_m() const { return impl_->space.cell_m; }

OccupancyGrid Room::occupancy(double min_m, double max_m) const {
  if (!(std::isfinite(min_m) && std::isfinite(max_m) && min_m <= max_m))
    refuse("occupancy: two heights are expected, the lower one first");
  const std::lock_guard lock(impl_->mutex);
  const auto found = impl_->grids.find({min_m, max_m});
  if (found != impl_->grids.end()) return found->second;
  OccupancyGrid grid = make_grid(*impl_, {min_m, max_m});
  grid.t_ns = impl_->t_ns;
  if (impl_->grids.size() < kMostGrids) impl_->grids.emplace(Impl::Band{min_m, max_m}, grid);
  return grid;
}

Space Room::at(const std::array<double, 3>& p_world) const {
  return to_api(state_at(impl_->space, to_vec3(p_world, "at")));
}

Space Room::box(const std::array<double, 3>& min_world,
                const std::array<double, 3>& max_world) const {
  const Vec3 low = to_vec3(min_world, "box"), high = to_vec3(max_world, "box");
  if ((high - low).minCoeff() < 0) refuse("box: the lower corner is expected first");
  if (((high - low) / impl_->space.cell_m + Vec3::Ones()).prod() > kMostCells)
    refuse("box: more than 10^8 cells");
  return to_api(state_of_box(impl_->space, low, high));
}

RayHit Room::ray(const std::array<double, 3>& from_world,
                 const std::array<double, 3>& direction_world, double max_m,
                 bool past_unknown) const {
  const Vec3 from = to_vec3(from_world, "ray"), direction = to_vec3(direction_world, "ray");
  if (!(direction.norm() > 0)) refuse("ray: a direction is expected");
  if (!(max_m >= 0 && max_m <= kFarthest_m)) refuse("ray: a length of 0 to 1000 m is expected");
  const SpaceRay ray{from, direction.normalized(), max_m, past_unknown};
  const auto [what, distance_m] = cast_ray(impl_->space, ray);
  return {to_api(what), distance_m};
}

}  // namespace ygslam::api
