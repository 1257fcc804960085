#include "features/attach.hpp"

#include <cmath>

#include "image/depth.hpp"

namespace ygslam {
namespace {

constexpr double kCornerRadius_px = 3;  // of the circle by which FAST finds a corner, in its level

}  // namespace

void attach_geometry(Features& features, const Camera& camera, const DepthImage& depth_m,
                     double pyramid_scale) {
  std::uint8_t octave = 0;
  double radius_px = kCornerRadius_px;
  for (Feature& f : features.points) {
    f.ideal_px = camera.undistort(f.uv_px.cast<double>()).cast<float>();
    f.depth_m = depth_m.empty() ? 0.0F : depth_at(depth_m, f.uv_px.x(), f.uv_px.y());
    if (f.octave != octave) {  // rarely: features come level by level
      octave = f.octave;
      radius_px = kCornerRadius_px * std::pow(pyramid_scale, octave);
    }
    f.on_depth_edge =
        f.depth_m > 0 && on_depth_edge(depth_m, f.uv_px.x(), f.uv_px.y(), f.depth_m, radius_px);
  }
}

}  // namespace ygslam
