// Bundle adjustment of a window of the map, or of the whole of it: some poses and all points free,
// the rest fixed. Plain problem in, result out.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "geometry/camera.hpp"
#include "optim/direction.hpp"
#include "optim/observation.hpp"
#include "optim/pose_graph.hpp"

namespace ygslam {

struct BundlePose {
  SE3 T_camera_world;
  bool fixed = false;
};

struct BundleObservation {
  std::uint32_t pose = 0;   ///< index into poses
  std::uint32_t point = 0;  ///< index into points
  Observation seen;
};

struct BundleProblem {
  std::vector<BundlePose> poses;
  std::vector<Vec3> points_world;  ///< all free
  std::vector<BundleObservation> observations;
  /// Relative-pose constraints, as of an inertial sensor, without a robust kernel (`robust` is not
  /// used).
  std::vector<PoseGraphEdge> motions;
  std::vector<MeasuredDirection> directions;  ///< without a robust kernel
};

struct BundleConfig {
  int iterations_robust = 2;  ///< with the Huber kernel on all observations of
                              ///< points that are not left out
  int iterations_refine = 6;  ///< after dropping outliers, pixels with the kernel of their tail
  double chi2_pixel = 5.991;  ///< Huber's delta^2: 95 % of chi2 with 2 degrees of freedom
  /// Squared residual from which a pixel is an outlier: six sigma, where little weight is left.
  double gate_chi2_pixel = 36;
  double tail_dof =
      3;  ///< degrees of freedom of Student's t, which pixels follow; infinite = Huber
  double chi2_depth = 3.841;  ///< 95 % of chi2 with 1 degree of freedom; also Huber's delta^2
  double relative_decrease =
      1e-5;  ///< a phase ends when a step lowers the cost by less than this share
};

struct BundleResult {
  bool usable = false;  ///< false: not finite, rank-deficient or cost grew; then poses and points
                        ///< are the input's
  std::vector<SE3> T_camera_world;
  std::vector<Vec3> points_world;
  std::vector<std::uint8_t> outlier;  ///< 1 per observation that disagrees at the end
  double initial_cost = 0;  ///< 1/2 sum of squared residuals under the kernels of the last phase,
                            ///< all motions, directions and observations of points that are
                            ///< not left out
  double final_cost = 0;    ///< the same sum at the end, never above initial_cost
  int iterations = 0;
  bool interrupted = false;  ///< the abort flag was seen; the result is what was reached so far
};

/// Two phases: all observations with Huber's kernel; then without the outliers, with the kernel of
/// Student's t on the pixels. Where only the depth disagrees the pixel still counts. Of the state
/// given and those after each phase the cheapest is kept. Left as they are: fixed poses (the first
/// pose if none is fixed), poses with fewer than 6 residuals (a motion has 6, directions do not
/// count) and points with fewer than 3.
/// @param abort where given, looked at for every point and in every column of the factorisation;
/// may be set by another thread and is to stay set. A step begun is then not taken.
///
/// Levenberg-Marquardt with the Schur complement on the points (Triggs et al. 2000, sec. 6.1).
/// Never throws; stops on iterations and convergence, never on the clock.
[[nodiscard]] BundleResult adjust_bundle(const Camera& camera, const BundleProblem& problem,
                                         const BundleConfig& config,
                                         const std::atomic<bool>* abort = nullptr);

}  // namespace ygslam
