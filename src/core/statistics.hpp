// Order statistics.
#pragma once

#include <algorithm>
#include <cstddef>
#include <ranges>

namespace ygslam {

/// The value at rank floor(share (n - 1)) of the n sorted values, which are reordered. Not to be
/// called without values. @param share in [0, 1].
template <std::ranges::random_access_range Values>
[[nodiscard]] auto quantile(Values&& values, double share) {
  const auto begin = std::ranges::begin(values);
  const auto rank =
      static_cast<std::ptrdiff_t>(share * static_cast<double>(std::ranges::size(values) - 1));
  std::nth_element(begin, begin + rank, std::ranges::end(values));
  return begin[rank];
}

/// The value at rank n / 2 of the n sorted values, which are reordered: of an even number the upper
/// of the two in the middle. Not to be called without values.
template <std::ranges::random_access_range Values>
[[nodiscard]] auto median(Values&& values) {
  const auto begin = std::ranges::begin(values);
  const auto middle = begin + static_cast<std::ptrdiff_t>(std::ranges::size(values) / 2);
  std::nth_element(begin, middle, std::ranges::end(values));
  return *middle;
}

/// The middle of sorted values, of an even number the mean of the two: for figures in reports. Not
/// to be called without values.
[[nodiscard]] inline double sorted_median(const std::ranges::random_access_range auto& sorted) {
  const std::size_t half = std::ranges::size(sorted) / 2;
  return std::ranges::size(sorted) % 2 == 1 ? sorted[half]
                                            : 0.5 * (sorted[half - 1] + sorted[half]);
}

}  // namespace ygslam
