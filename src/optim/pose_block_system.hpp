// Symmetric, positive definite equations in 6x6 blocks, one per pair of poses that have something
// to do with each other: the reduced camera system of a bundle adjustment, the normal equations of
// a pose graph. Dense below a size, sparse above it.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "geometry/se3.hpp"

namespace ygslam {

/// 6x6 block with its columns padded to 8, two AVX registers; the last two rows are of no account.
using PoseBlock = Eigen::Matrix<double, 8, 6>;

class PoseBlockSystem {
 public:
  /// Up to here the dense factorisation is the faster one.
  static constexpr int kLargestDense = 60;

  /// Starts anew with the diagonal blocks of this many poses.
  void reset(int poses);

  [[nodiscard]] int poses() const { return poses_; }
  /// Registers a pair; the same pair twice is one. Call before freeze(). @return the index of its
  /// block.
  std::uint32_t add_pair(std::uint32_t row, std::uint32_t column);
  /// No more pairs: lays out the matrices.
  void freeze();

  void set_zero();
  /// Block (row, column), row <= column, of the upper triangle, by the index add_pair gave.
  [[nodiscard]] PoseBlock& block(std::uint32_t index) { return blocks_[index]; }
  /// Diagonal block of a pose: its index is the pose's.
  [[nodiscard]] PoseBlock& diagonal(std::uint32_t pose) { return blocks_[pose]; }

  /// Solves S x = rhs in place. @return false if S is not positive definite or x not finite.
  [[nodiscard]] bool solve(Eigen::VectorXd& rhs);

 private:
  struct Pair {
    std::uint32_t row, column;
  };

  [[nodiscard]] bool is_dense() const { return poses_ <= kLargestDense; }
  [[nodiscard]] bool solve_dense(Eigen::VectorXd& rhs);
  [[nodiscard]] bool solve_sparse(Eigen::VectorXd& rhs);

  int poses_ = 0;
  std::vector<PoseBlock> blocks_;
  std::vector<Pair> pairs_;  // of blocks_, diagonal ones first
  std::unordered_map<std::uint64_t, std::uint32_t> index_of_pair_;
  Eigen::MatrixXd dense_;               // lower triangle used
  Eigen::SparseMatrix<double> sparse_;  // lower triangle stored
  std::vector<double*>
      sparse_entry_;  // of sparse_, 36 per block, column-major, null above the diagonal
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor_;
};

}  // namespace ygslam
