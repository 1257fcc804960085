#include "motion/checks/occlusion_boundary.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {

bool is_on_occlusion_boundary(const Feature& feature, const CoarseDepth& depth_m,
                              const OcclusionBoundaryConfig& config) {
  if (!feature.uv_px.allFinite()) return false;
  constexpr int kStep = CoarseDepth::kStep;
  const double support_px = config.support_px * std::pow(config.pyramid_scale, feature.octave);
  const int reach = static_cast<int>(std::ceil(support_px / kStep)) * kStep;
  const int u = static_cast<int>(std::lround(feature.uv_px.x()));
  const int v = static_cast<int>(std::lround(feature.uv_px.y()));
  float near_m = 0;
  float far_m = 0;
  for (int dv = -reach; dv <= reach; dv += kStep) {
    for (int du = -reach; du <= reach; du += kStep) {
      const float d = depth_m.at(u + du, v + dv);
      if (d <= 0) continue;
      near_m = near_m > 0 ? std::min(near_m, d) : d;
      far_m = std::max(far_m, d);
    }
  }
  if (near_m <= 0) return feature.depth_m <= 0;
  const auto limit_m = static_cast<float>((1 + config.behind_ratio) * near_m);
  return feature.depth_m > 0 ? feature.depth_m > limit_m : far_m > limit_m;
}

}  // namespace ygslam
