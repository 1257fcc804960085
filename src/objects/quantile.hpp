// Quantiles of points, per axis: what a median is to numbers.
#pragma once

#include <span>
#include <vector>

#include "core/statistics.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

/// @param points at least one, finite.
[[nodiscard]] inline Vec3 axis_quantile(std::span<const Vec3> points, double share) {
  Vec3 result;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    result[axis] = quantile(values, share);
  }
  return result;
}

}  // namespace ygslam
