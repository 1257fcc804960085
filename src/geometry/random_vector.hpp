// Vectors of random components. Draws among the arguments of one call come in any order: GCC takes
// the last first for x86-64, the first first for 64-bit ARM. Here the last component is drawn first
// everywhere.
#pragma once

#include <Eigen/Core>

#include "core/rng.hpp"

namespace ygslam {

/// @param draw gives one component a call.
template <typename Vector, typename Draw>
[[nodiscard]] Vector drawn_vector(Draw&& draw) {
  Vector v;
  for (Eigen::Index i = v.size() - 1; i >= 0; --i) v[i] = draw();
  return v;
}

template <int kSize>
[[nodiscard]] Eigen::Matrix<double, kSize, 1> random_normals(Rng& rng, double sigma = 1) {
  return drawn_vector<Eigen::Matrix<double, kSize, 1>>([&] { return rng.normal(0, sigma); });
}

/// Uniform in [low, high), component by component.
template <int kSize>
[[nodiscard]] Eigen::Matrix<double, kSize, 1> random_in_box(
    Rng& rng, const Eigen::Matrix<double, kSize, 1>& low,
    const Eigen::Matrix<double, kSize, 1>& high) {
  Eigen::Matrix<double, kSize, 1> v;
  for (int i = kSize - 1; i >= 0; --i) v[i] = rng.uniform(low[i], high[i]);
  return v;
}

}  // namespace ygslam
