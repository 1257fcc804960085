// Pose graph optimisation: poses that satisfy measured relative motions best, some of which may be
// wrong (Grisetti et al. 2010; Yang et al. 2020). Plain problem in, result out.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "geometry/se3.hpp"
#include "optim/direction.hpp"

namespace ygslam {

/// A measured relative motion. Its residual is the twist, translation first,
///   e = log( T_camera_world[to] * T_camera_world[from]^-1 * T_to_from^-1 ),
/// so that the poses say T_to_from <- exp(e) * T_to_from. That is the left perturbation of
/// PoseSolution::information, which serves here unchanged where the points are those of `from`.
struct PoseGraphEdge {
  std::uint32_t from = 0;  ///< index into PoseGraph::T_camera_world
  std::uint32_t to = 0;    ///< the same; another pose than `from`
  SE3 T_to_from;
  Mat6 information = Mat6::Identity();  ///< inverse covariance of e, symmetric [1/m^2, 1/rad^2]
  bool robust = false;  ///< may be wrong (a loop): graduated non-convexity gives it a weight
};

struct PoseGraph {
  std::vector<SE3> T_camera_world;
  std::vector<std::uint8_t> fixed;  ///< beside the poses; empty = none
  std::vector<PoseGraphEdge> edges;
  std::vector<MeasuredDirection> directions;  ///< of poses that edges hold, too; never robust
};

struct PoseGraphConfig {
  int max_iterations = 300;         ///< linear systems solved, all weights together
  double relative_decrease = 1e-8;  ///< a minimisation ends when a step lowers the cost by less
                                    ///< than this share,
  double step_tolerance = 1e-10;    ///< [m, rad] or when no pose would move by more
  bool gnc = true;                  ///< false: every edge keeps weight 1
  double inlier_chi2 = 16.812;      ///< 99 % of chi2 with 6 degrees of freedom: a robust edge that
                                    ///< costs more is left out
  double gnc_growth = 1.4;  ///< of the control parameter, per level (Yang et al. 2020, rem. 5)
};

struct PoseGraphResult {
  std::vector<SE3> T_camera_world;
  std::vector<double> edge_weight;  ///< beside the edges; of robust ones 0 (left out) or 1, between
                                    ///< the two only where stopped early
  double initial_cost = 0;          ///< 1/2 sum of e^T information e at the start, weights 1
  double cost = 0;  ///< 1/2 sum of weight * e^T information e at the end; directions: 1
  int iterations = 0;
  bool converged = false;  ///< false: stopped by the flag or by max_iterations, or not solvable
};

/// Levenberg-Marquardt on SE(3). Robust edges are judged by graduated non-convexity with truncated
/// least squares, from the weights that the given poses suggest: these should be odometry's, or an
/// optimum found earlier.
///
/// A wrong edge is found because the others contradict it. A group of k wrong edges that agree with
/// each other wins where all that contradicts it, odometry and true loops together, costs less than
/// leaving the group out: about k * (inlier_chi2 - 6), 6 being what an edge costs that is right.
/// Ten win against odometry alone up to a shift of 10 standard deviations of the way between their
/// ends.
///
/// The gauge: in each connected part of the graph without a fixed pose the first pose is held.
/// Poses that are not finite come back as they were given, not converged.
/// @param abort looked at in each iteration and in each column of the factorisation, where given;
/// may be set by another thread. Never stops on the clock; the same input gives the same bytes.
[[nodiscard]] PoseGraphResult optimize_pose_graph(const PoseGraph& graph,
                                                  const PoseGraphConfig& config,
                                                  const std::atomic<bool>* abort = nullptr);

/// e of PoseGraphEdge.
[[nodiscard]] Vec6 pose_graph_residual(const PoseGraphEdge& edge, const SE3& T_from_world,
                                       const SE3& T_to_world);

struct PoseGraphJacobians {
  Mat6 from, to;  ///< d e / d xi for T <- exp(xi) * T of either pose
};
/// @param e the residual at these poses.
[[nodiscard]] PoseGraphJacobians pose_graph_jacobians(const Vec6& e, const SE3& T_from_world,
                                                      const SE3& T_to_world);

}  // namespace ygslam
