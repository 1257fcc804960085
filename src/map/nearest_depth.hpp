// How far a keyframe saw: the nearest depth in each block of its image. Whatever lies clearly
// nearer on the same ray was not there then.
#pragma once

#include "geometry/se3.hpp"
#include "image/image.hpp"

namespace ygslam {

class NearestDepth {
 public:
  NearestDepth() = default;
  explicit NearestDepth(const DepthImage& depth_m);

  /// Forgets what was seen at and around a recorded pixel at about this depth: it was no part of
  /// the static world.
  void forget_around(const Vec2& uv_px, float depth_m);

  /// The nearest depth [m] seen in the blocks at and around a recorded pixel; 0 = nobody knows
  /// (outside the image, or too many pixels of its block without depth).
  [[nodiscard]] float around_m(const Vec2& uv_px) const;

 private:
  DepthImage block_m_;  // 0 = unknown
};

}  // namespace ygslam
