// The camera's motion between two frames out of flow and depth, and how far each point is from
// obeying it: a check in two dimensions where the epipolar line knows only one. It sees motion
// along the epipolar line and holds in pure rotation, where F is undetermined.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "motion/flow/flow_follower.hpp"

namespace ygslam {

struct EgoMotionConfig {
  bool enabled = true;    ///< false: the epipolar line alone decides, as in the paper
  int min_points = 20;    ///< fewer candidates with depth: no fit
  double limit_px = 2.0;  ///< farther from where the static world would be: dynamic
  /// ... and farther than this many medians of the candidates' residuals: fast motion blurs the
  /// image and shifts depth against colour.
  double limit_medians = 5.0;
  double final_scale_px = 0.7;  ///< width of the robust kernel in the last iterations
  int iterations = 12;
};

struct EgoMotion {
  SE3 T_current_previous;
  double limit_px = 0;  ///< by config and residuals: beyond, a point moves
  int candidates = 0;
  int inliers = 0;  ///< candidates within limit_px
};

struct EgoMotionResidual {
  /// Distance [px] from where the point would be if it stood still at its own depth. Without depth:
  /// as any_depth_px. Negative: not judged (not finite, or behind the camera).
  double own_depth_px = -1;
  /// The same at the depth of its range that suits it best; without depth: from the epipolar line.
  double any_depth_px = -1;
};

[[nodiscard]] EgoMotionResidual ego_motion_residual(const Camera& camera,
                                                    const SE3& T_current_previous,
                                                    const FollowedPoint& point);

/// Gauss-Newton on the reprojection with the Geman-McClure kernel, narrowed from the size of the
/// flow to final_scale_px (graduated non-convexity; Black and Rangarajan 1996).
/// @param candidate 1 for each point to fit from. @return nullopt if fewer than min_points vote,
/// fewer than half of them agree, or there is no finite solution.
[[nodiscard]] std::optional<EgoMotion> fit_ego_motion(const Camera& camera,
                                                      std::span<const FollowedPoint> points,
                                                      std::span<const std::uint8_t> candidate,
                                                      const SE3& guess,
                                                      const EgoMotionConfig& config);

}  // namespace ygslam
