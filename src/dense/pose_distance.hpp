// How far apart poses of views are.
#pragma once

#include <optional>

#include "geometry/se3.hpp"

namespace ygslam {

/// To the bit.
[[nodiscard]] inline bool same(const std::optional<SE3>& a, const std::optional<SE3>& b) {
  return a.has_value() == b.has_value() && (!a || (a->R() == b->R() && a->t() == b->t()));
}

/// Of what two cameras see at a typical depth [m].
[[nodiscard]] inline double distance_m(const SE3& T_world_a, const SE3& T_world_b) {
  constexpr double kTypicalDepth_m = 3;
  const SE3 T_a_b = T_world_a.inverse() * T_world_b;
  return T_a_b.t().norm() + kTypicalDepth_m * T_a_b.angle();
}

}  // namespace ygslam
