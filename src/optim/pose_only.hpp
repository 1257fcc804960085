// Camera pose from known points: robust minimisation of reprojection and depth residuals.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "optim/observation.hpp"

namespace ygslam {

struct PoseOnlyConfig {
  int rounds = 3;             ///< outliers are judged again after each round
  int iterations = 10;        ///< at most, per round
  double chi2_pixel = 5.991;  ///< Huber's delta^2: 95 % of chi2 with 2 degrees of freedom
  /// Squared residual from which a pixel counts as wrong: six sigma, where little weight is left.
  double gate_chi2_pixel = 36;
  /// Degrees of freedom of Student's t, which pixels follow in the later rounds; infinite = normal.
  double tail_dof = 3;
  double chi2_depth =
      3.841;  ///< 95 % of chi2 with 1 degree of freedom, applied to the depth residual
  int min_inliers = 6;
  int robust_rounds = 1;  ///< the first rounds, with Huber's kernel, which is convex
};

struct PoseObservation {
  Vec3 p_world = Vec3::Zero();
  Observation seen;
};

struct PoseSolution {
  SE3 T_camera_world;
  Mat6 information =
      Mat6::Zero();  ///< Hessian at the solution; twist of a left perturbation exp(xi) * T
  std::vector<std::uint8_t> inlier;  ///< 1 per observation that agrees and has weight
  int inliers = 0;
  double rms = 0;  ///< of the inliers' normalised reprojection residual, per
                   ///< coordinate: 1 where sigma_px is right
};

/// Levenberg-Marquardt in rounds; every observation is judged again after each round, so that one
/// excluded can come back. Where only the depth disagrees the pixel still counts. Observations that
/// are not finite, or lie behind the camera, are outliers.
/// @return nullopt if fewer than min_inliers agree or the solution is not finite.
[[nodiscard]] std::optional<PoseSolution> solve_pose(const Camera& camera,
                                                     const SE3& T_camera_world_guess,
                                                     std::span<const PoseObservation> observations,
                                                     const PoseOnlyConfig& config);

}  // namespace ygslam
