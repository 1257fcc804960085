// What every random-sample fit shares: its settings, its adaptive length, its samples.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/rng.hpp"

namespace ygslam {

struct RansacConfig {
  int max_iterations = 500;
  double confidence = 0.99;   ///< chance of at least one sample free of outliers
  double threshold_px = 1.0;  ///< a point within this distance of the model agrees with it
  int min_inliers = 15;       ///< fewer: no fit
};

/// Samples needed for one free of outliers with the given confidence
/// (Fischler and Bolles 1981; Hartley & Zisserman 2nd ed., eq. 4.18).
[[nodiscard]] inline int ransac_iterations(double inlier_share, int sample_size, double confidence,
                                           int max_iterations) {
  const double clean = std::pow(std::clamp(inlier_share, 0.0, 1.0), sample_size);
  if (clean >= 1.0 - 1e-12) return 1;
  if (clean <= 1e-12) return max_iterations;
  const double wanted = std::log(1.0 - confidence) / std::log1p(-clean);
  return static_cast<int>(std::clamp(std::ceil(wanted), 1.0, static_cast<double>(max_iterations)));
}

/// N different indices below n, each set equally likely. n >= N.
template <std::size_t N>
[[nodiscard]] std::array<std::uint32_t, N> draw_sample(std::uint32_t n, Rng& rng) {
  std::array<std::uint32_t, N> sample{};
  for (std::size_t i = 0; i < N;) {
    const std::uint32_t candidate = rng.below(n);
    const auto end = sample.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(sample.begin(), end, candidate) == end) sample[i++] = candidate;
  }
  return sample;
}

}  // namespace ygslam
