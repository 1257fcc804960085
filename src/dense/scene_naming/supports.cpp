#include "dense/scene_naming/supports.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

namespace ygslam {
namespace {

/// A vertex of a level surface below a box.
struct Below {
  double gap_m = 0;            // from the box down to it
  std::pair<int, int> square;  // of the ground
};

class Supports {
 public:
  Supports(const TriangleMesh& mesh, const Gravity& gravity, const SupportConfig& config)
      : config_(config) {
    const Vec3 up_world = gravity.up_world.normalized();
    for (const SurfacePoint& vertex : mesh.vertices)
      if (vertex.normal_world.cast<double>().dot(up_world) > config.level_cos)
        level_world_.push_back(vertex.p_world.cast<double>());
  }

  void extend(OrientedBox& box) const {
    const double gap_m = gap_below_m(box);
    if (gap_m <= 0) return;
    box.T_world_box = box.T_world_box * SE3(Mat3::Identity(), Vec3(0, 0, -0.5 * gap_m));
    box.size_m.z() += gap_m;
  }

 private:
  /// Down to the first surface that is large enough; 0 where none is.
  [[nodiscard]] double gap_below_m(const OrientedBox& box) const {
    const Vec2 sides_m = box.size_m.head<2>() + Vec2::Constant(2 * config_.beside_m);
    const double least = config_.min_share * (sides_m / config_.square_m).prod();
    std::vector<Below> below = vertices_below(box, sides_m);
    std::sort(below.begin(), below.end(),
              [](const Below& a, const Below& b) { return a.gap_m < b.gap_m; });
    std::span<const Below> surface;
    for (auto begin = below.begin(), end = begin; begin != below.end(); ++begin) {
      while (end != below.end() && end->gap_m - begin->gap_m <= config_.level_m) ++end;
      if (!surface.empty() && begin->gap_m - surface.front().gap_m > config_.level_m) break;
      const std::span<const Below> level(begin, end);
      if (level.size() > surface.size() && squares_of(level) >= least) surface = level;
    }
    double sum_m = 0;
    for (const Below& vertex : surface) sum_m += vertex.gap_m;
    return surface.empty() ? 0 : sum_m / static_cast<double>(surface.size());
  }

  [[nodiscard]] static double squares_of(std::span<const Below> surface) {
    std::set<std::pair<int, int>> squares;
    for (const Below& vertex : surface) squares.insert(vertex.square);
    return static_cast<double>(squares.size());
  }

  [[nodiscard]] std::vector<Below> vertices_below(const OrientedBox& box,
                                                  const Vec2& sides_m) const {
    const double reach_m =
        std::max(config_.least_reach_m, config_.reach_of_height * box.size_m.z());
    const SE3 T_box_world = box.T_world_box.inverse();
    std::vector<Below> below;
    for (const Vec3& p_world : level_world_) {
      const Vec3 p = T_box_world * p_world;
      const double gap_m = -0.5 * box.size_m.z() - p.z();
      if (gap_m < -config_.above_m || gap_m > reach_m) continue;
      if ((p.head<2>().cwiseAbs().array() > 0.5 * sides_m.array()).any()) continue;
      const auto square = [&](int axis) {
        return static_cast<int>(std::floor(p[axis] / config_.square_m));
      };
      below.push_back({gap_m, {square(0), square(1)}});
    }
    return below;
  }

  const SupportConfig& config_;
  std::vector<Vec3> level_world_;
};

}  // namespace

void stand_on_supports(const TriangleMesh& mesh, const Gravity& gravity,
                       std::span<SceneObject> objects, const SupportConfig& config) {
  const Supports supports(mesh, gravity, config);
  for (SceneObject& object : objects) {
    supports.extend(object.box);
    for (EarlierPlace& place : object.earlier) supports.extend(place.box);
  }
}

}  // namespace ygslam
