#include "dense/surface_sample.hpp"

#include <algorithm>

namespace ygslam {
namespace {

constexpr int kNeighbours = 3;  // noise makes single pixels and the edges of things look new

/// How many are set that at least so many of the eight around them are set, too.
int count_with_neighbours(const GreyImage& set, int neighbours) {
  int count = 0;
  for (int v = 0; v < set.height(); ++v) {
    for (int u = 0; u < set.width(); ++u) {
      if (set.at(u, v) == 0) continue;
      int around = -1;  // it is among those counted
      for (int v2 = std::max(v - 1, 0); v2 <= std::min(v + 1, set.height() - 1); ++v2)
        for (int u2 = std::max(u - 1, 0); u2 <= std::min(u + 1, set.width() - 1); ++u2)
          around += set.at(u2, v2);
      count += around >= neighbours ? 1 : 0;
    }
  }
  return count;
}

}  // namespace

SurfaceSample::SurfaceSample(const DepthView& view, const PreparationConfig& config, int step_px)
    : camera_(view.camera),
      step_px_(step_px),
      depth_(view.camera.width / step_px, view.camera.height / step_px) {
  PreparedView prepared;
  prepared.assign(view, config);
  for (int v = 0; v < depth_.height(); ++v) {
    for (int u = 0; u < depth_.width(); ++u) {
      const int at_u = u * step_px + step_px / 2, at_v = v * step_px + step_px / 2;
      const std::uint32_t geometry = prepared.geometry()[at_v * view.camera.width + at_u];
      if (geometry >> 24 != 0) depth_.at(u, v) = static_cast<std::uint16_t>(geometry & 0xffffU);
    }
  }
}

double SurfaceSample::share_seen_less(int views, const SE3& T_world_camera,
                                      const SurfaceLayer& surface) const {
  int all = 0;
  GreyImage is_less(depth_.width(), depth_.height(), 0);
  for (int v = 0; v < depth_.height(); ++v) {
    for (int u = 0; u < depth_.width(); ++u) {
      if (depth_.at(u, v) == 0) continue;
      const double depth_m = depth_.at(u, v) * DepthView::kUnit_m;
      const int u_px = u * step_px_ + step_px_ / 2;
      const int v_px = v * step_px_ + step_px_ / 2;
      const Vec3 ray((u_px - camera_.cx) / camera_.fx, (v_px - camera_.cy) / camera_.fy, 1);
      const Vec3 p_world = T_world_camera * Vec3(depth_m * ray);
      const auto voxel =
          surface.voxel((p_world / surface.config().voxel_m).array().floor().cast<int>());
      ++all;
      is_less.at(u, v) = !voxel || voxel->views < views ? 1 : 0;
    }
  }
  const int less = count_with_neighbours(is_less, kNeighbours);
  return all > 0 ? static_cast<double>(less) / all : 0;
}

}  // namespace ygslam
