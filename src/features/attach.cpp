#include "features/attach.hpp"

#include "image/depth.hpp"

namespace ygslam {
namespace {

constexpr double kCornerRadius_px = 3;  // of the circle by which FAST finds a corner, in its level

}  // namespace

void attach_geometry(Features& features, const Camera& camera, const DepthImage& depth_m,
                     const PyramidScales& scales) {
  for (Feature& f : features.points) {
    f.ideal_px = camera.undistort(f.uv_px.cast<double>()).cast<float>();
    f.depth_m = depth_m.empty() ? 0.0F : depth_at(depth_m, f.uv_px.x(), f.uv_px.y());
    f.on_depth_edge = f.depth_m > 0 && on_depth_edge(depth_m, f.uv_px.x(), f.uv_px.y(), f.depth_m,
                                                     kCornerRadius_px * scales.of(f.octave));
  }
}

}  // namespace ygslam
