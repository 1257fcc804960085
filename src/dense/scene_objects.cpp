#include "dense/scene_objects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/check.hpp"
#include "scene/floor_frame.hpp"

namespace ygslam {
namespace {

constexpr int kYaws = 45;  // of boxes: steps of 2 degrees

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

/// The largest set of points that hang together: cubes of a size that touch.
std::vector<Vec3> largest_part(const std::vector<Vec3>& points, double cube_m) {
  using Index = std::array<int, 3>;
  std::map<Index, std::vector<std::size_t>> cubes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3i c = (points[i] / cube_m).array().floor().cast<int>();
    cubes[{c.x(), c.y(), c.z()}].push_back(i);
  }
  std::vector<std::size_t> largest;
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
    if (part.size() > largest.size()) largest = std::move(part);
  }
  std::vector<Vec3> result;
  for (const std::size_t i : largest) result.push_back(points[i]);
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

std::vector<SceneObject> place_objects(const ObjectMap& objects, const Gravity& gravity,
                                       TriangleMesh& mesh, SpaceCells& space,
                                       const PlacingConfig& config) {
  std::map<SceneObjectId, std::vector<Vec3>> points;
  for (SurfacePoint& vertex : mesh.vertices) {
    if (vertex.label.object == kNoSceneObject) continue;
    vertex.label.object = objects.current(vertex.label.object);
    points[vertex.label.object].push_back(vertex.p_world.cast<double>());
  }
  std::map<SceneObjectId, SceneObject> placed;
  for (const auto& [id, p_world] : points) {
    const auto known = objects.objects().find(id);
    if (known == objects.objects().end()) continue;  // its keyframes went
    const KnownObject& from = known->second;
    SceneObject object;
    object.id = id;
    object.semantic_class = from.best_class();
    object.probability = from.probability();
    object.box = upright_box(largest_part(p_world, config.gap_m), gravity, config.box_share);
    object.views = from.views();
    object.first_seen = *from.seen.begin();
    object.last_seen = *from.seen.rbegin();
    if (object.views >= config.min_views && p_world.size() >= config.min_vertices)
      object.state = ObjectState::kStatic;
    placed.emplace(id, object);
  }
  const auto name = [&](SurfaceLabel& label) {
    if (label.object == kNoSceneObject) return;
    const auto object = placed.find(objects.current(label.object));
    if (object == placed.end() || object->second.state != ObjectState::kStatic) {
      label = {};
      return;
    }
    label.object = object->first;
    label.semantic_class = object->second.semantic_class;
    label.probability *= object->second.probability;
  };
  for (SurfacePoint& vertex : mesh.vertices) name(vertex.label);
  for (SpaceCell& cell : space.cells) name(cell.label);
  std::vector<SceneObject> result;
  for (const auto& [id, object] : placed) result.push_back(object);
  return result;
}

}  // namespace ygslam
