// A view's surface in a few pixels, to ask how well the map knows it.
#pragma once

#include "geometry/se3.hpp"
#include "volume/depth_view.hpp"
#include "volume/surface_layer.hpp"

namespace ygslam {

class SurfaceSample {
 public:
  SurfaceSample() = default;
  /// One pixel of each square of step_px a side, where it makes a surface.
  SurfaceSample(const DepthView& view, const PreparationConfig& config, int step_px);

  /// Share of it, 0 to 1, in voxels that fewer than `views` saw; 0 of nothing.
  [[nodiscard]] double share_seen_less(int views, const SE3& T_world_camera,
                                       const SurfaceLayer& surface) const;
  [[nodiscard]] std::size_t bytes() const { return depth_.size() * sizeof(std::uint16_t); }

 private:
  Pinhole camera_;
  int step_px_ = 1;
  Image<std::uint16_t> depth_;  // as DepthView has it, 0 = makes no surface
};

}  // namespace ygslam
