// Sparse Cholesky factorisation of a symmetric matrix of 6x6 blocks (Davis 2006, ch. 4): the
// ordering and the pattern are found once, the numbers as often as needed. The blocks keep the
// arithmetic in vector registers, which a factorisation by single entries does not.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/se3.hpp"

namespace ygslam {

/// 6x6 block with its columns padded to 8, two AVX registers; the last two rows are of no account.
using PoseBlock = Eigen::Matrix<double, 8, 6>;

struct PosePair {
  std::uint32_t row, column;
};

class BlockCholesky {
 public:
  /// @param pairs the blocks (row <= column) of the upper triangle, each once; diagonal ones are
  /// there anyway.
  void analyze(int poses, std::span<const PosePair> pairs);

  /// @param blocks beside the pairs. @return false if not positive definite, or if the flag was set
  /// meanwhile; it is looked at in each column of blocks.
  [[nodiscard]] bool factorize(std::span<const PoseBlock> blocks,
                               const std::atomic<bool>* abort = nullptr);
  /// Solves A x = rhs in place, after factorize().
  void solve(Eigen::VectorXd& rhs);

 private:
  // Where a block of the matrix goes to.
  struct Place {
    std::uint32_t index;  // of diagonal_ or below_
    bool is_diagonal, is_transposed;
  };
  // A block of the factor left of a column's diagonal.
  struct Left {
    std::uint32_t index;  // of below_
    std::uint32_t end;    // of its column, in below_
  };

  void order(int poses, std::span<const PosePair> pairs);
  void lay_out(std::span<const PosePair> pairs);
  void place(std::span<const PosePair> pairs);
  void load(std::span<const PoseBlock> blocks);
  void subtract_left(std::uint32_t column);
  [[nodiscard]] bool finish_column(std::uint32_t column);

  std::uint32_t size_ = 0;
  std::vector<std::uint32_t> position_;      // of each pose in the order of elimination
  std::vector<std::uint32_t> column_begin_;  // of row_ and below_, size_ + 1
  std::vector<std::uint32_t> row_;           // ascending in each column, below the diagonal
  std::vector<std::uint32_t> left_begin_;    // of left_, size_ + 1
  std::vector<Left> left_;                   // by row
  std::vector<Place> place_;                 // beside the pairs
  std::vector<PoseBlock> below_;             // the factor, below the diagonal
  std::vector<Mat6> diagonal_;               // lower triangle used
  std::vector<std::uint32_t> below_of_row_;  // in the column at work
  Eigen::VectorXd permuted_;
};

}  // namespace ygslam
