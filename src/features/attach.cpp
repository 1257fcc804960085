#include "features/attach.hpp"

#include "image/depth.hpp"

namespace ygslam {

void attach_geometry(Features& features, const Camera& camera, const DepthImage& depth_m) {
  for (Feature& f : features.points) {
    f.ideal_px = camera.undistort(f.uv_px.cast<double>()).cast<float>();
    f.depth_m = depth_m.empty() ? 0.0F : depth_at(depth_m, f.uv_px.x(), f.uv_px.y());
  }
}

}  // namespace ygslam
