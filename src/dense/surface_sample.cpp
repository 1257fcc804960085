#include "dense/surface_sample.hpp"

namespace ygslam {

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
  int all = 0, less = 0;
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
      less += !voxel || voxel->views < views ? 1 : 0;
    }
  }
  return all > 0 ? static_cast<double>(less) / all : 0;
}

}  // namespace ygslam
