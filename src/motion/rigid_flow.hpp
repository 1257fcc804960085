// The camera's motion between two frames out of flow and depth, and how far each point is from
// obeying it: a check in two dimensions where the epipolar line knows only one. It sees motion
// along the epipolar line and holds in pure rotation, where F is undetermined.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam {

struct RigidFlowConfig {
  bool enabled = true;    ///< false: the epipolar line alone decides, as in the paper
  int min_points = 20;    ///< fewer voters with depth: no fit
  double limit_px = 2.0;  ///< farther from where the static world would be: dynamic
  /// ... and farther than this many medians of the voters' residuals: fast motion blurs the image
  /// and shifts depth against colour.
  double limit_medians = 5.0;
  double final_scale_px = 0.7;  ///< width of the robust kernel in the last iterations
  int iterations = 12;
};

/// The depths [m] seen around a point: at the edge of an object the sensor's depth may be off by a
/// few pixels, and the corner belongs to either surface. Both 0 = none.
struct DepthRange {
  float min_m = 0;
  float max_m = 0;
};

/// Nearest and farthest depth in the square of half side radius_px about a pixel.
[[nodiscard]] DepthRange depth_range(const DepthImage& depth_m, const Eigen::Vector2f& uv_px,
                                     int radius_px);

/// A followed point with its depth.
struct RigidPoint {
  Vec2 previous_px = Vec2::Zero();  ///< ideal
  Vec2 current_px = Vec2::Zero();   ///< ideal
  double depth_m = 0;               ///< in the previous frame; 0 = none: takes no part in the fit
  DepthRange range;                 ///< around it in the previous frame
};

struct RigidFit {
  SE3 T_current_previous;
  double limit_px = 0;  ///< by config and residuals: beyond, a point moves
  int voters = 0;
  int inliers = 0;    ///< voters within limit_px
  double rms_px = 0;  ///< of the inliers
};

struct RigidResidual {
  /// Distance [px] from where the point would be if it stood still at its own depth. Without depth:
  /// as any_depth_px. Negative: not judged (not finite, or behind the camera).
  double own_depth_px = -1;
  /// The same at the depth of its range that suits it best; without depth: from the epipolar line.
  double any_depth_px = -1;
};

[[nodiscard]] RigidResidual rigid_residual(const Camera& camera, const SE3& T_current_previous,
                                           const RigidPoint& point);

/// A given motion held against the voters, which should obey it.
[[nodiscard]] RigidFit judge_rigid_flow(const Camera& camera, std::span<const RigidPoint> points,
                                        std::span<const std::uint8_t> voter,
                                        const SE3& T_current_previous,
                                        const RigidFlowConfig& config);

/// Gauss-Newton on the reprojection with the Geman-McClure kernel, narrowed from the size of the
/// flow to final_scale_px (graduated non-convexity; Black and Rangarajan 1996).
/// @param voter 1 for each point to fit from. @return nullopt if fewer than min_points vote, fewer
/// than half of them agree, or there is no finite solution.
[[nodiscard]] std::optional<RigidFit> fit_rigid_flow(const Camera& camera,
                                                     std::span<const RigidPoint> points,
                                                     std::span<const std::uint8_t> voter,
                                                     const SE3& guess,
                                                     const RigidFlowConfig& config);

}  // namespace ygslam
