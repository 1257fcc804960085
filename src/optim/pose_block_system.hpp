// Symmetric, positive definite equations in 6x6 blocks, one per pair of poses that have something
// to do with each other: the reduced camera system of a bundle adjustment, the normal equations of
// a pose graph. Solved by a sparse Cholesky factorisation block by block.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "optim/block_cholesky.hpp"

namespace ygslam {

class PoseBlockSystem {
 public:
  /// Starts anew with the diagonal blocks of this many poses.
  void reset(int poses);

  [[nodiscard]] int poses() const { return poses_; }
  /// Diagonal and other blocks so far.
  [[nodiscard]] std::size_t blocks() const { return pairs_.size(); }
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

  /// Solves S x = rhs in place. @return false if S is not positive definite, x not finite, or the
  /// flag was set meanwhile.
  [[nodiscard]] bool solve(Eigen::VectorXd& rhs, const std::atomic<bool>* abort = nullptr);

 private:
  int poses_ = 0;
  std::vector<PoseBlock> blocks_;
  std::vector<PosePair> pairs_;  // of blocks_, diagonal ones first
  std::unordered_map<std::uint64_t, std::uint32_t> index_of_pair_;
  BlockCholesky factor_;
};

}  // namespace ygslam
