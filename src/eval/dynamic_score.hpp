// How well points were told to be moving or standing: precision and recall against exact or
// recorded truth, and the overlap of masks.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "image/image.hpp"

namespace ygslam {

/// Truth of one frame.
struct DynamicTruth {
  GreyImage ids;     ///< per pixel the instance of a movable thing, 0 = none
  GreyImage moving;  ///< 255 where the surface moved since the previous frame; empty: ids > 0 moves
};

/// A point as it was judged. `dynamic` is false for static and for unknown ones.
struct JudgedPoint {
  Eigen::Vector2f uv_px = Eigen::Vector2f::Zero();
  bool dynamic = false;
};

struct PointCounts {
  std::size_t found = 0;         ///< moving and judged dynamic
  std::size_t missed = 0;        ///< moving and not judged dynamic
  std::size_t false_alarms = 0;  ///< standing and judged dynamic
  std::size_t standing = 0;      ///< standing and not judged dynamic
  std::size_t left_out = 0;      ///< on movable things at rest, or at a mask's edge

  /// 1 where nothing was there to be found, or nothing was judged dynamic.
  [[nodiscard]] double recall() const;
  [[nodiscard]] double precision() const;
  PointCounts& operator+=(const PointCounts& other);
};

/// Points within this of a mask's edge belong to either side and are left out.
inline constexpr int kEdge_px = 3;

/// Points outside the image are left out.
[[nodiscard]] PointCounts count_points(std::span<const JudgedPoint> points,
                                       const DynamicTruth& truth);

/// Pixels of two masks (0 = outside) of one size.
struct MaskOverlap {
  std::size_t both = 0;
  std::size_t either = 0;
  /// Intersection over union; 1 where both are empty.
  [[nodiscard]] double iou() const;
  MaskOverlap& operator+=(const MaskOverlap& other);
};
[[nodiscard]] MaskOverlap overlap(const GreyImage& a, const GreyImage& b);

}  // namespace ygslam
