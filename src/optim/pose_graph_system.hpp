// The normal equations of a pose graph. The pattern is set out once; nothing is allocated from one
// iteration to the next.
#pragma once

#include <span>

#include "optim/pose_block_system.hpp"
#include "optim/pose_graph.hpp"

namespace ygslam {

class PoseGraphSystem {
 public:
  /// `graph` must outlive it and stay as it is.
  explicit PoseGraphSystem(const PoseGraph& graph);

  [[nodiscard]] bool has_unknowns() const { return !pose_of_slot_.empty(); }
  /// e^T information e of each edge.
  void chi2(std::span<const SE3> T_camera_world, std::vector<double>& chi2) const;
  void linearize(std::span<const SE3> T_camera_world, std::span<const double> edge_weight);
  /// Solves the equations of the last linearize(), each diagonal entry enlarged by the share
  /// lambda. @return false if they are not positive definite or the flag was set
  /// meanwhile.
  [[nodiscard]] bool solve(double lambda, const std::atomic<bool>* abort);
  /// Largest entry of the last solution [m, rad].
  [[nodiscard]] double largest_step() const { return step_.lpNorm<Eigen::Infinity>(); }
  /// `from` moved by the last solution, written to `to`.
  void apply_step(std::span<const SE3> from, std::vector<SE3>& to) const;

 private:
  static constexpr std::uint32_t kNoBlock = ~0u;

  void choose_unknowns();

  const PoseGraph& graph_;
  std::vector<std::int32_t> slot_of_pose_;  // -1 = held
  std::vector<std::uint32_t> pose_of_slot_;
  std::vector<std::uint32_t> block_of_edge_;  // off the diagonal, or kNoBlock
  std::vector<PoseBlock> linearized_;         // of all blocks, without damping
  Eigen::VectorXd gradient_, step_;
  PoseBlockSystem equations_;
};

}  // namespace ygslam
