// When ground is known from an earlier visit.
#pragma once

namespace ygslam {

/// Nearer than this to a keyframe that is older than this, another one would show the same.
struct KnownGround {
  static constexpr double kNear_m = 0.2, kNear_rad = 0.2;
  static constexpr double kVisit_s = 10;
};

}  // namespace ygslam
