// How far a keyframe saw: the nearest depth in each block of its image. Whatever lies clearly
// nearer on the same ray was not there then.
#pragma once

#include <span>
#include <utility>

#include "geometry/se3.hpp"
#include "image/image.hpp"

namespace ygslam {

class FreeSpaceImage {
 public:
  FreeSpaceImage() = default;
  /// @param movers recorded pixel (u, v) and depth [m] of points that are no part of the static
  /// world: what was seen around them at about their depth is forgotten.
  explicit FreeSpaceImage(const DepthImage& depth_m, std::span<const Vec3> movers = {});

  /// The nearest depth [m] seen in the blocks at and around a recorded pixel; 0 = nobody knows
  /// (outside the image, or too many pixels of its block without depth).
  [[nodiscard]] float around_m(const Vec2& uv_px) const;

  /// The blocks themselves, to be kept in a file.
  [[nodiscard]] const DepthImage& blocks_m() const { return nearest_m_; }
  [[nodiscard]] static FreeSpaceImage of_blocks(DepthImage blocks_m) {
    FreeSpaceImage image;
    image.nearest_m_ = std::move(blocks_m);
    return image;
  }

 private:
  DepthImage nearest_m_;  // per block, of it and its neighbours; 0 = unknown
};

}  // namespace ygslam
