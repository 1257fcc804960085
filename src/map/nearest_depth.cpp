#include "map/nearest_depth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ygslam {
namespace {

constexpr int kBlockPx = 8;
constexpr float kSameDepthRatio = 0.1F;
// A thing that gives no depth leaves a hole; what is seen around it says nothing of it.
constexpr int kMinKnown = kBlockPx * kBlockPx * 7 / 8;

float nearest_m(const DepthImage& depth_m, int u0, int v0) {
  float nearest = std::numeric_limits<float>::max();
  int known = 0;
  for (int v = v0; v < v0 + kBlockPx; ++v) {
    const float* row = depth_m.row(v);
    for (int u = u0; u < u0 + kBlockPx; ++u) {
      const bool valid = row[u] > 0;
      known += static_cast<int>(valid);
      nearest = valid ? std::min(nearest, row[u]) : nearest;
    }
  }
  return known >= kMinKnown ? nearest : 0;
}

/// Beyond any image for a pixel that is nowhere.
std::pair<int, int> block_of(const Vec2& uv_px) {
  if (!(uv_px.cwiseAbs().maxCoeff() < 1e6)) return {-2, -2};
  return {static_cast<int>(std::floor((uv_px.x() + 0.5) / kBlockPx)),
          static_cast<int>(std::floor((uv_px.y() + 0.5) / kBlockPx))};
}

}  // namespace

NearestDepth::NearestDepth(const DepthImage& depth_m)
    : block_m_(depth_m.width() / kBlockPx, depth_m.height() / kBlockPx) {
  for (int v = 0; v < block_m_.height(); ++v)
    for (int u = 0; u < block_m_.width(); ++u)
      block_m_.at(u, v) = nearest_m(depth_m, u * kBlockPx, v * kBlockPx);
}

void NearestDepth::forget_around(const Vec2& uv_px, float depth_m) {
  const auto [u, v] = block_of(uv_px);
  for (int y = std::max(v - 1, 0); y <= std::min(v + 1, block_m_.height() - 1); ++y)
    for (int x = std::max(u - 1, 0); x <= std::min(u + 1, block_m_.width() - 1); ++x)
      if (std::abs(block_m_.at(x, y) - depth_m) < kSameDepthRatio * depth_m) block_m_.at(x, y) = 0;
}

float NearestDepth::around_m(const Vec2& uv_px) const {
  const auto [u, v] = block_of(uv_px);
  if (!block_m_.contains(u, v) || block_m_.at(u, v) <= 0) return 0;
  float nearest = block_m_.at(u, v);
  for (int y = std::max(v - 1, 0); y <= std::min(v + 1, block_m_.height() - 1); ++y)
    for (int x = std::max(u - 1, 0); x <= std::min(u + 1, block_m_.width() - 1); ++x)
      if (const float d = block_m_.at(x, y); d > 0) nearest = std::min(nearest, d);
  return nearest;
}

}  // namespace ygslam
