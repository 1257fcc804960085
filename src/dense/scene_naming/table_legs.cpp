#include "dense/scene_naming/table_legs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

namespace ygslam {
namespace {

using Place = std::array<int, 2>;  // of a column, counted in the top's axes

struct Column {
  std::vector<std::uint32_t> vertices;
  double low_m = std::numeric_limits<double>::infinity();  // above the floor
  double high_m = 0;
  Vec3 lowest_world = Vec3::Zero(), highest_world = Vec3::Zero();
  bool is_beside = false;  // the top, not under what was seen of it
};

class UnderTop {
 public:
  UnderTop(const OrientedBox& top, const Gravity& gravity, const SpaceCells& space,
           const TriangleMesh& mesh, const TableLegsConfig& config)
      : config_(config),
        space_(space),
        mesh_(mesh),
        up_world_(gravity.up_world),
        T_top_world_(top.T_world_box.inverse()),
        top_m_(top.T_world_box.t().dot(gravity.up_world) - gravity.floor_m + 0.5 * top.size_m.z()) {
    half_m_ = 0.5 * top.size_m.head<2>();
    const Eigen::Vector2d reach_m = half_m_.array() + config.panel_beside_m;
    for (std::uint32_t i = 0; i < mesh.vertices.size(); ++i) {
      const SurfacePoint& vertex = mesh.vertices[i];
      if (vertex.label.object != kNoSceneObject) continue;
      const Vec3 p_world = vertex.p_world.cast<double>();
      const double height_m = p_world.dot(up_world_) - gravity.floor_m;
      if (height_m < config.min_height_m || height_m > top_m_ + config.above_m) continue;
      const Vec3 p_top = T_top_world_ * p_world;
      const bool is_upright =
          std::abs(vertex.normal_world.cast<double>().dot(up_world_)) <= config.upright_cos;
      if (!is_upright || (p_top.head<2>().cwiseAbs().array() > reach_m.array()).any()) continue;
      const bool stands_on_it =
          height_m > top_m_ + config.plate_m &&
          (p_top.head<2>().cwiseAbs().array() < half_m_.array() - config.plate_m).all();
      if (stands_on_it) continue;
      add(i, p_top, p_world, height_m);
    }
  }

  /// Vertices of what hangs and of legs.
  [[nodiscard]] std::vector<std::uint32_t> its_vertices() {
    std::vector<std::uint32_t> its;
    std::map<Place, Column> standing;
    for (auto& [place, column] : columns_) {
      if (column.low_m <= config_.stands_m)
        standing.emplace(place, std::move(column));
      else if (hangs(column))
        its.insert(its.end(), column.vertices.begin(), column.vertices.end());
    }
    while (!standing.empty()) {
      const Column part = take_part(standing);
      if (is_leg(part)) its.insert(its.end(), part.vertices.begin(), part.vertices.end());
    }
    return its;
  }

 private:
  void add(std::uint32_t vertex, const Vec3& p_top, const Vec3& p_world, double height_m) {
    Column& column = columns_[{static_cast<int>(std::floor(p_top.x() / config_.column_m)),
                               static_cast<int>(std::floor(p_top.y() / config_.column_m))}];
    column.vertices.push_back(vertex);
    column.is_beside |= (p_top.head<2>().cwiseAbs().array() > half_m_.array()).any();
    if (height_m > column.high_m) {
      column.high_m = height_m;
      column.highest_world = p_world;
    }
    if (height_m < column.low_m) {
      column.low_m = height_m;
      column.lowest_world = p_world;
    }
  }

  /// Share of what lies so far above a point, or below it, that was seen to be air; beside the
  /// point itself.
  [[nodiscard]] double share_free(const Vec3& p_world, double low_m, double high_m) const {
    int looks = 0, free = 0;
    for (double m = low_m; m < high_m; m += space_.cell_m) {
      ++looks;
      free += is_free(space_, p_world + m * up_world_) ? 1 : 0;
    }
    return looks > 0 ? static_cast<double>(free) / looks : 0;
  }

  /// A partition that stands beside a table does.
  [[nodiscard]] bool goes_on_above(const Column& column) const {
    return column.high_m > top_m_ + config_.plate_m;
  }

  [[nodiscard]] bool hangs(const Column& column) const {
    if (goes_on_above(column)) return false;
    // Right under the top its plate is what lies above; beside it that must be hidden.
    const double beside_m = 1.5 * space_.cell_m;
    const double least_m = column.is_beside ? beside_m + 0.5 * space_.cell_m : 0;
    return share_free(column.lowest_world, -config_.seen_below_m - beside_m, -beside_m) >
               config_.free_share &&
           share_free(column.highest_world, beside_m, std::max(least_m, top_m_ - column.high_m)) <
               config_.free_share;
  }

  /// Columns that touch, taken out of all.
  [[nodiscard]] static Column take_part(std::map<Place, Column>& columns) {
    Column part;
    std::vector<Place> open{columns.begin()->first};
    while (!open.empty()) {
      const auto [x, y] = open.back();
      open.pop_back();
      const auto found = columns.find({x, y});
      if (found == columns.end()) continue;
      const Column& column = found->second;
      part.vertices.insert(part.vertices.end(), column.vertices.begin(), column.vertices.end());
      part.low_m = std::min(part.low_m, column.low_m);
      part.high_m = std::max(part.high_m, column.high_m);
      columns.erase(found);
      for (int n = 0; n < 9; ++n) open.push_back({x + n % 3 - 1, y + n / 3 - 1});
    }
    return part;
  }

  [[nodiscard]] bool is_leg(const Column& part) const {
    if (part.high_m < top_m_ - config_.reach_m || goes_on_above(part)) return false;
    Eigen::AlignedBox2d extent_top;
    for (const std::uint32_t i : part.vertices)
      extent_top.extend((T_top_world_ * mesh_.vertices[i].p_world.cast<double>()).head<2>().eval());
    const Eigen::Vector2d far_m = extent_top.min().cwiseAbs().cwiseMax(extent_top.max().cwiseAbs());
    return extent_top.sizes().maxCoeff() < config_.thickest_leg_m &&
           (far_m.array() <= half_m_.array() + config_.leg_beside_m).all();
  }

  const TableLegsConfig& config_;
  const SpaceCells& space_;
  const TriangleMesh& mesh_;
  Vec3 up_world_;
  SE3 T_top_world_;
  double top_m_;  // above the floor
  Eigen::Vector2d half_m_;
  std::map<Place, Column> columns_;
};

}  // namespace

void name_under_top(const OrientedBox& top, const SurfaceLabel& label, const Gravity& gravity,
                    const SpaceCells& space, const TableLegsConfig& config, TriangleMesh& mesh) {
  for (const std::uint32_t vertex : UnderTop(top, gravity, space, mesh, config).its_vertices())
    mesh.vertices[vertex].label = label;
}

}  // namespace ygslam
