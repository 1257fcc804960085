// Quantiles of points, per axis: what a median is to numbers.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "geometry/se3.hpp"

namespace ygslam {

/// @param values at least one; left in another order. @param share 0 = least .. 1 = most.
[[nodiscard]] inline double quantile_of(std::vector<double>& values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

/// @param points at least one, finite.
[[nodiscard]] inline Vec3 quantile(std::span<const Vec3> points, double share) {
  Vec3 result;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    result[axis] = quantile_of(values, share);
  }
  return result;
}

}  // namespace ygslam
