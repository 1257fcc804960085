#include "dense/background/thin_structures.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "core/check.hpp"
#include "dense/known_object.hpp"

namespace ygslam {
namespace {

constexpr float kBefore_m = 0.06F, kBeforeShare = 0.03F;  // of the mesh: more than its noise
constexpr float kBeside_m = 0.03F;                        // depths of one object beside each other
constexpr int kLeastBeside = 4;                           // of its eight neighbours
constexpr double kCell_m = 0.02;
constexpr float kReach_px = 0.6F;   // from the middle of a pixel that shows a point
constexpr int kLeastViews = 2;      // that saw it in the same place
constexpr double kGrain_m = 0.004;  // one point for a cube of this size
constexpr auto kDepthUnit_m = static_cast<float>(DepthView::kUnit_m);

Camera camera_of(const Pinhole& pinhole) {
  CameraConfig config;
  config.fx = pinhole.fx, config.fy = pinhole.fy, config.cx = pinhole.cx, config.cy = pinhole.cy;
  config.width = pinhole.width, config.height = pinhole.height;
  return Camera(config);
}

/// A pixel between two surfaces has fewer like it around.
bool hangs_together(const DepthView& view, int u, int v) {
  const float z_m = static_cast<float>(view.depth.at(u, v)) * kDepthUnit_m;
  int beside = 0;
  for (int i = 0; i < 9; ++i) {
    const int x = u + i % 3 - 1, y = v + i / 3 - 1;
    if (i == 4 || !view.depth.contains(x, y)) continue;
    const float other_m = static_cast<float>(view.depth.at(x, y)) * kDepthUnit_m;
    beside += std::abs(other_m - z_m) <= kBeside_m ? 1 : 0;
  }
  return beside >= kLeastBeside;
}

/// The view's points that the mesh lies behind.
std::vector<ColouredPoint> before_mesh(const DenseMap::PlacedView& placed, MeshView& mesh) {
  const DepthView view = placed.view->restored();
  const Camera camera = camera_of(view.camera);
  const FrameGeometry geometry(camera, placed.T_world_camera, {});
  GreyImage all(camera.width(), camera.height());
  std::fill(all.begin(), all.end(), std::uint8_t{255});
  const SurfaceImage surface = mesh.draw(geometry, all);
  std::vector<ColouredPoint> points;
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u) {
      const float z_m = static_cast<float>(view.depth.at(u, v)) * kDepthUnit_m;
      const float mesh_m = surface.depth_m.at(u, v);
      if (!(z_m > 0) || view.object.at(u, v) == DepthView::kExcluded) continue;
      if (!(z_m + std::max(kBefore_m, kBeforeShare * z_m) < mesh_m)) continue;
      if (hangs_together(view, u, v))
        points.push_back({geometry.unproject(u, v, z_m), view.colour.at(u, v)});
    }
  }
  return points;
}

}  // namespace

ThinStructures::ThinStructures(const std::vector<DenseMap::PlacedView>& views, MeshView& mesh) {
  struct SeenCell {
    std::size_t last_view = 0;
    int views = 0;
  };
  std::unordered_map<CellKey, SeenCell> cells;
  const auto key_of = [](const ColouredPoint& point) {
    return cell_key(point.p_world.cast<double>(), kCell_m);
  };
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (const ColouredPoint& point : before_mesh(views[i], mesh)) {
      SeenCell& cell = cells[key_of(point)];
      if (cell.views == 0 || cell.last_view != i) ++cell.views;
      cell.last_view = i;
      points_.push_back(point);
    }
  }
  std::erase_if(points_, [&](const ColouredPoint& point) {
    return cells.at(key_of(point)).views < kLeastViews;
  });
  std::unordered_set<CellKey> taken;
  std::erase_if(points_, [&](const ColouredPoint& point) {
    return !taken.insert(cell_key(point.p_world.cast<double>(), kGrain_m)).second;
  });
  points_.shrink_to_fit();
}

void ThinStructures::draw(const FrameGeometry& geometry, const GreyImage& wanted,
                          SurfaceImage& surface) const {
  CHECK(wanted.same_size(surface.depth_m));
  for (const ColouredPoint& point : points_) {
    const auto seen = geometry.project(point.p_world);
    if (!seen) continue;
    // Its pixel was about as large as one of this image.
    const float u0 = std::floor(seen->uv_px.x()), v0 = std::floor(seen->uv_px.y());
    if (!(std::abs(u0) < 1e6F && std::abs(v0) < 1e6F)) continue;
    for (int i = 0; i < 4; ++i) {
      const int u = static_cast<int>(u0) + (i & 1), v = static_cast<int>(v0) + (i >> 1);
      const bool is_near = std::abs(static_cast<float>(u) - seen->uv_px.x()) <= kReach_px &&
                           std::abs(static_cast<float>(v) - seen->uv_px.y()) <= kReach_px;
      if (!is_near || !wanted.contains(u, v) || wanted.at(u, v) == 0) continue;
      float& depth_m = surface.depth_m.at(u, v);
      if (depth_m != 0 && depth_m <= seen->z_m) continue;
      depth_m = seen->z_m;
      surface.colour.at(u, v) = point.colour;
    }
  }
}

}  // namespace ygslam
