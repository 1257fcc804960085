// The normal equations of bundle adjustment and their solution by the Schur complement on the
// points (Triggs et al. 2000, sec. 6.1). Observations are sorted by point; nothing is allocated
// from one iteration to the next.
#pragma once

#include <atomic>
#include <span>

#include "optim/local_bundle.hpp"
#include "optim/pose_block_system.hpp"
#include "optim/residual.hpp"

namespace ygslam {

struct BundleState {
  std::vector<SE3> T_camera_world;
  std::vector<Vec3> points_world;
};

/// An observation ready for use; `weight` is the caller's, `use_*` are it or 0.
struct BundleTerm {
  WhitenedObservation<double> seen;
  double weight = 0, use_pixel = 0, use_depth = 0;
  std::uint32_t pose = 0;
  std::uint32_t point = 0;
  std::uint32_t source = 0;  ///< index into BundleProblem::observations
};

/// Sorted by point, then pose.
[[nodiscard]] std::vector<BundleTerm> sorted_terms(const Camera& camera,
                                                   const BundleProblem& problem);
/// Takes the terms of points with fewer than three residuals out of use.
void drop_undetermined_points(std::vector<BundleTerm>& terms, std::size_t points);
/// 1/2 sum of weighted, robustified squared residuals of the parts in use.
[[nodiscard]] double bundle_cost(const std::vector<BundleTerm>& terms, const BundleState& state,
                                 const ResidualKernels& kernels);
/// The same of motions, without kernels.
[[nodiscard]] double motion_cost(std::span<const PoseGraphEdge> motions, const BundleState& state);

class BundleSystem {
 public:
  /// Sets out the system for those parts of `terms` that are in use; the points they see and the
  /// poses with at least six residuals are unknowns. `terms`, `motions` and `directions` must
  /// outlive it and stay as they are.
  /// @param abort where given, looked at for every point and in every column of the factorisation;
  /// once set, nothing that was computed is of use.
  BundleSystem(const std::vector<BundleTerm>& terms, std::span<const PoseGraphEdge> motions,
               std::span<const MeasuredDirection> directions,
               const std::vector<std::uint8_t>& pose_is_fixed,
               const std::atomic<bool>* abort = nullptr);

  [[nodiscard]] bool has_unknowns() const { return !points_.empty() || reduced_.poses() > 0; }
  void linearize(const BundleState& state, const ResidualKernels& kernels);
  /// Solves the equations of the last linearize(), each diagonal entry enlarged by the share
  /// lambda. @return false if they are not positive definite, or when aborted.
  [[nodiscard]] bool solve(double lambda);
  /// `from` moved by the last solution, written to `to`.
  void apply_step(const BundleState& from, BundleState& to) const;

 private:
  using Mat43 = Eigen::Matrix<double, 4, 3>;        // 3x3, columns padded to one AVX register
  using Elimination = Eigen::Matrix<double, 8, 3>;  // 6x3, columns padded to two
  struct Linearized {
    Mat43 AR;  // J^T W J R, J = d r / d p_cam
    Vec3 p_cam;
  };
  struct Point {
    std::uint32_t index = 0;           // of the state
    std::uint32_t begin = 0, end = 0;  // of kept_
    std::uint32_t pairs = 0;           // first of pair_block_
    Mat43 H = Mat43::Zero();           // normal matrix
    Mat3 L = Mat3::Zero();             // Cholesky factor of it, damped
    Vec3 g = Vec3::Zero();             // gradient
    Vec3 Lg = Vec3::Zero();            // L^-1 g
    Vec3 step = Vec3::Zero();
  };
  struct Kept {
    std::uint32_t term;
    std::uint32_t pose;  // of the state
    std::int32_t slot;   // free pose, or -1
  };

  void choose_unknowns(const std::vector<std::uint8_t>& pose_is_fixed);
  void list_pairs();
  void list_motion_pairs();
  void linearize_motions(const BundleState& state);
  void linearize_directions(const BundleState& state);
  void eliminate_pairs(const Point& point);
  void start_reduced(double lambda);
  [[nodiscard]] bool eliminate(Point& point, double lambda);
  void back_substitute();

  /// What a motion couples: its block of the reduced system.
  struct Coupling {
    std::uint32_t block;
    Mat6 H = Mat6::Zero();  // of the upper triangle
  };

  const std::vector<BundleTerm>& terms_;
  std::span<const PoseGraphEdge> motions_;
  std::span<const MeasuredDirection> directions_;
  const std::atomic<bool>* abort_;
  std::vector<std::int32_t> slot_of_pose_;
  std::vector<std::uint32_t> pose_of_slot_;
  std::vector<Point> points_;
  std::vector<Kept> kept_;
  std::vector<Linearized> linearized_;  // beside kept_
  std::vector<std::uint32_t> pair_block_;
  std::vector<Elimination> eliminated_;  // H_pose_point L^-T, of one point's observations
  std::vector<Mat43> R_transposed_;      // per pose
  std::vector<Mat6> H_pose_;             // per slot, lower triangle
  std::vector<Vec6> g_pose_;
  std::vector<std::int32_t> coupling_of_motion_;  // -1 where an end is not free
  std::vector<Coupling> couplings_;
  PoseBlockSystem reduced_;
  Eigen::VectorXd pose_step_;
};

}  // namespace ygslam
