#include "map/free_space_image.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ygslam {
namespace {

constexpr int kBlock_px = 8;
constexpr double kSameDepthRatio = 0.1;
// A thing that gives no depth leaves a hole; what is seen around it says nothing of it.
constexpr int kMinKnown = kBlock_px * kBlock_px * 7 / 8;

float nearest_m(const DepthImage& depth_m, int u0, int v0) {
  float nearest = std::numeric_limits<float>::max();
  int known = 0;
  for (int v = v0; v < v0 + kBlock_px; ++v) {
    const float* row = depth_m.row(v);
    for (int u = u0; u < u0 + kBlock_px; ++u) {
      const bool valid = row[u] > 0;
      known += static_cast<int>(valid);
      nearest = valid ? std::min(nearest, row[u]) : nearest;
    }
  }
  return known >= kMinKnown ? nearest : 0;
}

struct Block {
  int u = 0, v = 0;
};

/// Beyond any image for a pixel that is nowhere.
Block block_of(double u_px, double v_px) {
  if (!(std::abs(u_px) < 1e6 && std::abs(v_px) < 1e6)) return {-2, -2};
  return {static_cast<int>(std::floor((u_px + 0.5) / kBlock_px)),
          static_cast<int>(std::floor((v_px + 0.5) / kBlock_px))};
}

template <typename Visitor>
void visit_around(DepthImage& blocks_m, const Block& at, Visitor&& visitor) {
  for (int v = std::max(at.v - 1, 0); v <= std::min(at.v + 1, blocks_m.height() - 1); ++v)
    for (int u = std::max(at.u - 1, 0); u <= std::min(at.u + 1, blocks_m.width() - 1); ++u)
      visitor(blocks_m.at(u, v));
}

}  // namespace

FreeSpaceImage::FreeSpaceImage(const DepthImage& depth_m, std::span<const Vec3> movers) {
  DepthImage blocks_m(depth_m.width() / kBlock_px, depth_m.height() / kBlock_px);
  for (int v = 0; v < blocks_m.height(); ++v)
    for (int u = 0; u < blocks_m.width(); ++u)
      blocks_m.at(u, v) = nearest_m(depth_m, u * kBlock_px, v * kBlock_px);
  for (const Vec3& mover : movers) {
    visit_around(blocks_m, block_of(mover.x(), mover.y()), [&](float& block_m) {
      if (std::abs(block_m - mover.z()) < kSameDepthRatio * mover.z()) block_m = 0;
    });
  }
  nearest_m_ = blocks_m;
  for (int v = 0; v < blocks_m.height(); ++v) {
    for (int u = 0; u < blocks_m.width(); ++u) {
      float& nearest = nearest_m_.at(u, v);
      if (nearest <= 0) continue;
      visit_around(blocks_m, {u, v}, [&](float block_m) {
        if (block_m > 0) nearest = std::min(nearest, block_m);
      });
    }
  }
}

float FreeSpaceImage::around_m(const Vec2& uv_px) const {
  const Block at = block_of(uv_px.x(), uv_px.y());
  return nearest_m_.contains(at.u, at.v) ? nearest_m_.at(at.u, at.v) : 0;
}

}  // namespace ygslam
