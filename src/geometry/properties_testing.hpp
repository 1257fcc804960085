// Random numbers, vectors and poses for properties tried by RapidCheck. The seed is fixed where
// this is included; RC_PARAMS in the environment tries others.
#pragma once

#include <rapidcheck.h>

#include <cstdlib>
#include <numbers>

#include "geometry/se3.hpp"

namespace ygslam::properties {

[[maybe_unused]] inline const int kSeedIsFixed = setenv("RC_PARAMS", "seed=1", 0);

// A number from low to high, uniform; failing cases shrink towards the middle.
inline double real(double low, double high) {
  constexpr int kSteps = 1'000'000;
  const auto steps = rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, 2 * kSteps + 1));
  const int folded = *steps;  // 0, 1, 2, 3 ... stand for 0, -1, 1, -2 ...
  const int step = folded % 2 == 0 ? folded / 2 : -(folded + 1) / 2;
  return 0.5 * (low + high) + 0.5 * (high - low) * step / kSteps;
}

inline Vec3 vector(double size) {
  return {real(-size, size), real(-size, size), real(-size, size)};
}

inline Vec3 direction() {
  const Vec3 v = vector(1);
  RC_PRE(v.norm() > 0.1);
  return v.normalized();
}

// A motion turning by at most max_angle_rad and moving by at most size_m along each axis.
inline SE3 motion(double max_angle_rad, double size_m) {
  const Vec3 axis = direction();
  return {so3_exp(real(0, max_angle_rad) * axis), vector(size_m)};
}

inline SE3 pose() { return motion(std::numbers::pi, 10); }

}  // namespace ygslam::properties
