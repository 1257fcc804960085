#include "dense/scene_naming/scene_objects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/check.hpp"
#include "dense/round_objects.hpp"
#include "scene/floor_frame.hpp"

namespace ygslam {
namespace {

constexpr int kYaws = 45;            // of boxes: steps of 2 degrees
constexpr double kMainShare = 0.25;  // of the largest part

struct Extent {
  double low_m = 0, high_m = 0;
  [[nodiscard]] double size_m() const { return high_m - low_m; }
};

/// Without a share of the values at either end.
Extent inner_extent(std::vector<double> values_m, double share_left_out) {
  const auto out =
      static_cast<std::ptrdiff_t>(share_left_out * static_cast<double>(values_m.size()));
  const auto low = values_m.begin() + out;
  const auto high = values_m.end() - 1 - out;
  std::nth_element(values_m.begin(), low, values_m.end());
  const double low_m = *low;
  std::nth_element(low, high, values_m.end());
  return {low_m, *high};
}

/// Points of the largest set that hangs together (cubes of a size that touch), and of those that
/// have a share of its points: what stands before an object parts it.
std::vector<Vec3> main_parts(const std::vector<Vec3>& points, double cube_m) {
  using Index = std::array<int, 3>;
  std::map<Index, std::vector<std::size_t>> cubes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3i c = (points[i] / cube_m).array().floor().cast<int>();
    cubes[{c.x(), c.y(), c.z()}].push_back(i);
  }
  std::vector<std::vector<std::size_t>> parts;
  std::size_t largest = 0;
  while (!cubes.empty()) {
    std::vector<std::size_t> part;
    std::vector<Index> open{cubes.begin()->first};
    while (!open.empty()) {
      const Index at = open.back();
      open.pop_back();
      const auto cube = cubes.find(at);
      if (cube == cubes.end()) continue;
      part.insert(part.end(), cube->second.begin(), cube->second.end());
      cubes.erase(cube);
      for (int n = 0; n < 27; ++n)
        open.push_back({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
    }
    largest = std::max(largest, part.size());
    parts.push_back(std::move(part));
  }
  std::vector<Vec3> result;
  for (const std::vector<std::size_t>& part : parts) {
    if (static_cast<double>(part.size()) < kMainShare * static_cast<double>(largest)) continue;
    for (const std::size_t i : part) result.push_back(points[i]);
  }
  return result;
}

}  // namespace

OrientedBox upright_box(std::span<const Vec3> p_world, const Gravity& gravity,
                        double share_left_out) {
  CHECK(!p_world.empty());
  const SE3 T_floor_world = T_world_floor(gravity).inverse();
  std::vector<double> x, y, z;
  for (const Vec3& p : p_world) {
    const Vec3 p_floor = T_floor_world * p;
    x.push_back(p_floor.x());
    y.push_back(p_floor.y());
    z.push_back(p_floor.z());
  }
  const auto along = [&](double yaw) {
    std::vector<double> values(x.size());
    for (std::size_t i = 0; i < x.size(); ++i)
      values[i] = std::cos(yaw) * x[i] + std::sin(yaw) * y[i];
    return inner_extent(std::move(values), share_left_out);
  };
  double best_yaw = 0, best_m2 = std::numeric_limits<double>::infinity();
  Extent best_x, best_y;
  for (int i = 0; i < kYaws; ++i) {
    const double yaw = std::numbers::pi / 2 * i / kYaws;
    const Extent extent_x = along(yaw), extent_y = along(yaw + std::numbers::pi / 2);
    const double m2 = extent_x.size_m() * extent_y.size_m();
    if (m2 >= best_m2) continue;
    best_m2 = m2;
    best_yaw = yaw;
    best_x = extent_x;
    best_y = extent_y;
  }
  const Extent height = inner_extent(std::move(z), share_left_out);
  const Mat3 R_floor_box = so3_exp(Vec3(0, 0, best_yaw));
  const Vec3 low(best_x.low_m, best_y.low_m, height.low_m);
  const Vec3 high(best_x.high_m, best_y.high_m, height.high_m);
  return {T_world_floor(gravity) * SE3(R_floor_box, R_floor_box * (0.5 * (low + high))),
          high - low};
}

namespace {

ObjectState state_of(const KnownObject& object, int epochs, Timestamp now,
                     const PlacingConfig& config) {
  const auto is_older = [now](Timestamp stamp, double seconds) {
    return seconds_between(now, stamp) > seconds;
  };
  const bool was_moving = object.moving && *object.moving >= *object.shown.rbegin();
  if (was_moving && !is_older(*object.moving, config.moving_s)) return ObjectState::kMoving;
  if (object.found_empty) return ObjectState::kAbsent;
  if (object.views() < config.min_views || object.probability() < config.min_probability)
    return ObjectState::kCandidate;
  if (is_older(*object.shown.rbegin(), config.out_of_sight_s)) return ObjectState::kUnobserved;
  return epochs > 1 ? ObjectState::kSettled : ObjectState::kStatic;
}

/// What is hidden of a round object reaches as far as what is seen of it is wide.
void complete_round(const Vec3& viewed_along_world, OrientedBox& box) {
  const int shorter = box.size_m.x() < box.size_m.y() ? 0 : 1;
  const double missing_m = box.size_m[1 - shorter] - box.size_m[shorter];
  const Vec3 axis_world = box.T_world_box.R().col(shorter);
  const double side = axis_world.dot(viewed_along_world) < 0 ? -1 : 1;
  const Vec3 middle_world = box.T_world_box.t() + side * missing_m / 2 * axis_world;
  box.T_world_box = SE3(box.T_world_box.R(), middle_world);
  box.size_m[shorter] += missing_m;
}

OrientedBox box_of(const KnownObject& object, const Gravity& gravity, const PlacingConfig& config) {
  std::vector<Vec3> surface = object.surface_world();
  if (surface.empty()) surface.push_back(object.extent_world.center());
  OrientedBox box = upright_box(main_parts(surface, config.gap_m), gravity, config.box_share);
  // Sideways it ends half the way to the next point beyond the last, but not where it faces those
  // who saw it: there, as above, its surface was seen. So much the more lies behind it.
  Vec3 behind_m = Vec3::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    const Vec3 axis_world = box.T_world_box.R().col(axis);
    box.size_m[axis] += config.patch_m;
    behind_m +=
        config.patch_m / 2 * axis_world.dot(object.viewed_along_world.normalized()) * axis_world;
  }
  box.T_world_box = SE3(box.T_world_box.R(), box.T_world_box.t() + behind_m);
  if (is_round(object.best_class())) complete_round(object.viewed_along_world, box);
  return box;
}

SceneObject placed_object(const ObjectMap& objects, SceneObjectId id, const Gravity& gravity,
                          const PlacingConfig& config) {
  const KnownObject& known = objects.objects().at(id);
  SceneObject object;
  object.id = objects.thing(id);
  object.semantic_class = known.best_class();
  object.probability = known.probability();
  object.box = box_of(known, gravity, config);
  object.views = known.views();
  object.first_seen = *known.seen.begin();
  object.last_seen = *known.seen.rbegin();
  while ((id = objects.earlier(id)) != kNoSceneObject) {
    const KnownObject& before = objects.objects().at(id);
    ++object.epochs;
    object.views += before.views();
    object.first_seen = *before.seen.begin();
    object.earlier.insert(object.earlier.begin(),
                          {box_of(before, gravity, config), *before.seen.begin(),
                           *before.seen.rbegin(), *before.found_empty});
  }
  object.state = state_of(known, object.epochs, objects.now(), config);
  object.found_empty = known.found_empty;
  if (known.views() >= config.min_views)
    object.known = *std::next(known.seen.begin(), config.min_views - 1);
  return object;
}

bool is_named(ObjectState state) {
  return state != ObjectState::kCandidate && state != ObjectState::kAbsent &&
         state != ObjectState::kMoving;
}

/// What surfaces of an object are called, for those that are sure enough.
using Names = std::map<SceneObjectId, SurfaceLabel>;

void name(const ObjectMap& objects, const Names& names, SurfaceLabel& label) {
  if (label.object == kNoSceneObject) return;
  const auto found = names.find(objects.thing(label.object));
  if (found == names.end()) {
    label = {};
    return;
  }
  const float share = label.probability;
  label = found->second;
  label.probability *= share;
}

}  // namespace

std::vector<SceneObject> place_objects(const ObjectMap& objects, const Gravity& gravity,
                                       TriangleMesh& mesh, SpaceCells& space,
                                       const PlacingConfig& config) {
  std::map<SceneObjectId, SceneObject> placed;
  for (const auto& [id, known] : objects.objects()) {
    if (objects.has_later(id)) continue;
    SceneObject object = placed_object(objects, id, gravity, config);
    placed.emplace(object.id, std::move(object));
  }
  Names names;
  for (const auto& [id, object] : placed)
    if (is_named(object.state))
      names.emplace(id, SurfaceLabel{object.semantic_class, id, object.probability});
  for (SurfacePoint& vertex : mesh.vertices) name(objects, names, vertex.label);
  for (SpaceCell& cell : space.cells) name(objects, names, cell.label);
  std::vector<SceneObject> result;
  for (const auto& [id, object] : placed) result.push_back(object);
  return result;
}

void name_surfaces(const ObjectMap& objects, TriangleMesh& mesh, const PlacingConfig& config) {
  Names names;
  for (const auto& [id, known] : objects.objects()) {
    if (objects.has_later(id) || !is_named(state_of(known, 1, objects.now(), config))) continue;
    const SceneObjectId thing = objects.thing(id);
    names.emplace(thing, SurfaceLabel{known.best_class(), thing, known.probability()});
  }
  for (SurfacePoint& vertex : mesh.vertices) name(objects, names, vertex.label);
}

}  // namespace ygslam
