// Camera pose from points whose place in the world is known, many of them matched wrongly.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "geometry/ransac.hpp"

namespace ygslam {

struct PnpPoint {
  Vec3 p_world = Vec3::Zero();
  Vec2 ideal_px = Vec2::Zero();
  double depth_m = 0;  ///< measured along the optical axis; 0 = not measured
};

struct PnpConfig {
  RansacConfig ransac = {.max_iterations = 1000, .threshold_px = 4.0, .min_inliers = 10};
  /// A measured depth agrees within this difference of inverse depths [1/m]: about 5 standard
  /// deviations of a structured-light sensor (Khoshelham and Elberink 2012).
  double threshold_inverse_depth = 0.02;
};

struct PnpResult {
  SE3 T_camera_world;
  std::vector<std::uint8_t>
      inlier;  ///< 1 per point that agrees in the image and, if known, in depth
  int inliers = 0;
  int iterations = 0;  ///< samples drawn
};

struct P3pSolutions {
  std::array<SE3, 4> T_camera_world;
  int count = 0;
};

/// All poses that put three world points on three rays, in front of the camera.
/// Grunert's quartic in the form of Haralick et al. 1991, sec. 2.1, each root polished on the
/// distances between the points.
/// @param rays unit vectors in the camera frame. Points on a line or in one place: no solution.
[[nodiscard]] P3pSolutions solve_p3p(const std::array<Vec3, 3>& rays,
                                     const std::array<Vec3, 3>& p_world);

/// P3P in an adaptive RANSAC, the best pose so far improved on its inliers (Chum et al. 2003).
/// Samples whose measured depths contradict the distances between their points are passed over.
/// Points that are not finite are never inliers. Meant as a start for solve_pose().
/// @return nullopt if fewer than min_inliers points agree with any pose found.
[[nodiscard]] std::optional<PnpResult> solve_pnp_ransac(const Camera& camera,
                                                        std::span<const PnpPoint> points,
                                                        const PnpConfig& config, Rng& rng);

}  // namespace ygslam
