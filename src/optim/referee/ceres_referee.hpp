// The same least-squares problems given to Ceres with automatic derivatives: the referee of tests
// and benchmarks. Nothing of the library links it.
#pragma once

#include <cmath>
#include <vector>

#include "optim/local_bundle.hpp"
#include "optim/pose_graph.hpp"
#include "optim/pose_only.hpp"

namespace ygslam::referee {

struct Settings {
  int iterations = 300;
  double relative_decrease = 1e-16;
  /// Huber's delta^2; infinite = no kernel.
  double chi2_pixel = 5.991;
  double chi2_depth = 3.841;
  /// Of Cauchy's kernel on pixels, in place of Huber's; infinite = Huber's.
  double tail_dof = HUGE_VAL;
};

struct Solution {
  std::vector<SE3> T_camera_world;
  std::vector<Vec3> points_world;
  double initial_cost = 0, final_cost = 0;
  int iterations = 0;
};

/// One robust phase over all observations, Schur complement on the points, one thread.
[[nodiscard]] Solution adjust_bundle(const Camera& camera, const BundleProblem& problem,
                                     const Settings& settings);
/// Over all observations given, points fixed.
[[nodiscard]] Solution solve_pose(const Camera& camera, const SE3& T_camera_world_guess,
                                  const std::vector<PoseObservation>& observations,
                                  const Settings& settings);
/// All weights 1, sparse normal equations, one thread; the first pose is held if none is fixed.
[[nodiscard]] Solution optimize_pose_graph(const PoseGraph& graph, const Settings& settings);

}  // namespace ygslam::referee
