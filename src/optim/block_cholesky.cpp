#include "optim/block_cholesky.hpp"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

#include "core/check.hpp"
#include "optim/stop_flag.hpp"

namespace ygslam {
namespace {

// block <- block * L^-T, a column of it after the other.
void divide_by_transposed(const Mat6& L, PoseBlock& block) {
  for (int c = 0; c < 6; ++c) {
    for (int k = 0; k < c; ++k) block.col(c) -= L(c, k) * block.col(k);
    block.col(c) *= 1.0 / L(c, c);
  }
}

}  // namespace

void BlockCholesky::analyze(int poses, std::span<const PosePair> pairs) {
  size_ = static_cast<std::uint32_t>(poses);
  order(poses, pairs);
  lay_out(pairs);
  place(pairs);
  diagonal_.resize(size_);
  below_.resize(row_.size());
  below_of_row_.assign(size_, 0);
}

// Minimum degree on the graph of blocks, far smaller than that of single entries.
void BlockCholesky::order(int poses, std::span<const PosePair> pairs) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const PosePair& p : pairs) {
    CHECK(p.row <= p.column && p.column < size_);
    entries.emplace_back(static_cast<int>(p.column), static_cast<int>(p.row), 1.0);
  }
  Eigen::SparseMatrix<double> pattern(poses, poses);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> elimination;
  Eigen::AMDOrdering<int>()(pattern.selfadjointView<Eigen::Lower>(), elimination);
  position_.resize(size_);
  for (std::uint32_t i = 0; i < size_; ++i) {
    position_[static_cast<std::uint32_t>(elimination.indices()[i])] = i;
  }
}

// The rows of a column of the factor are its own and those of its children in the elimination tree,
// whose parent is the first row below the diagonal.
void BlockCholesky::lay_out(std::span<const PosePair> pairs) {
  std::vector<std::vector<std::uint32_t>> rows(size_), children(size_);
  for (const PosePair& p : pairs) {
    const auto [low, high] = std::minmax(position_[p.row], position_[p.column]);
    if (low != high) rows[low].push_back(high);
  }
  column_begin_.assign(1, 0);
  row_.clear();
  std::vector<std::uint32_t> last_column(size_, ~0u);  // that has this row
  for (std::uint32_t j = 0; j < size_; ++j) {
    std::vector<std::uint32_t> own;
    const auto add = [&](std::uint32_t row) {
      if (row > j && last_column[row] != j) own.push_back(row);
      last_column[row] = j;
    };
    std::ranges::for_each(rows[j], add);
    for (const std::uint32_t child : children[j]) {
      for (auto k = column_begin_[child]; k < column_begin_[child + 1]; ++k) add(row_[k]);
    }
    std::ranges::sort(own);
    if (!own.empty()) children[own.front()].push_back(j);
    row_.insert(row_.end(), own.begin(), own.end());
    column_begin_.push_back(static_cast<std::uint32_t>(row_.size()));
  }
  left_begin_.assign(size_ + 1, 0);
  for (const std::uint32_t row : row_) ++left_begin_[row + 1];
  for (std::uint32_t i = 0; i < size_; ++i) left_begin_[i + 1] += left_begin_[i];
  std::vector<std::uint32_t> next(left_begin_.begin(), left_begin_.end() - 1);
  left_.resize(row_.size());
  for (std::uint32_t j = 0; j < size_; ++j) {
    for (auto k = column_begin_[j]; k < column_begin_[j + 1]; ++k) {
      left_[next[row_[k]]++] = {k, column_begin_[j + 1]};
    }
  }
}

void BlockCholesky::place(std::span<const PosePair> pairs) {
  place_.clear();
  for (const PosePair& p : pairs) {
    const std::uint32_t row = position_[p.row], column = position_[p.column];
    if (row == column) {
      place_.push_back({row, true, false});
      continue;
    }
    const auto [low, high] = std::minmax(row, column);
    const auto begin = row_.begin() + column_begin_[low],
               end = row_.begin() + column_begin_[low + 1];
    const auto index =
        static_cast<std::uint32_t>(std::lower_bound(begin, end, high) - row_.begin());
    place_.push_back({index, false, row < column});
  }
}

void BlockCholesky::load(std::span<const PoseBlock> blocks) {
  CHECK(blocks.size() == place_.size());
  for (PoseBlock& block : below_) block.setZero();
  for (Mat6& block : diagonal_) block.setZero();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const auto block = blocks[i].topRows<6>();
    const Place& place = place_[i];
    if (place.is_diagonal) {
      diagonal_[place.index] = block;
    } else if (place.is_transposed) {
      below_[place.index].topRows<6>() = block.transpose();
    } else {
      below_[place.index].topRows<6>() = block;
    }
  }
}

// column <- column - (what stands left of it) * (what stands left of its diagonal)^T.
void BlockCholesky::subtract_left(std::uint32_t column) {
  for (auto k = column_begin_[column]; k < column_begin_[column + 1]; ++k)
    below_of_row_[row_[k]] = k;
  for (auto l = left_begin_[column]; l < left_begin_[column + 1]; ++l) {
    const PoseBlock& left = below_[left_[l].index];
    const Mat6 transposed = left.topRows<6>().transpose();
    diagonal_[column].noalias() -= left.topRows<6>().lazyProduct(transposed);
    for (auto k = left_[l].index + 1; k < left_[l].end; ++k) {
      below_[below_of_row_[row_[k]]].noalias() -= below_[k].lazyProduct(transposed);
    }
  }
}

bool BlockCholesky::finish_column(std::uint32_t column) {
  const Eigen::LLT<Eigen::Ref<Mat6>> factor(diagonal_[column]);  // in place
  if (factor.info() != Eigen::Success) return false;
  for (auto k = column_begin_[column]; k < column_begin_[column + 1]; ++k) {
    divide_by_transposed(diagonal_[column], below_[k]);
  }
  return true;
}

bool BlockCholesky::factorize(std::span<const PoseBlock> blocks, const std::atomic<bool>* abort) {
  load(blocks);
  for (std::uint32_t column = 0; column < size_; ++column) {
    if (is_stopped(abort)) return false;
    subtract_left(column);
    if (!finish_column(column)) return false;
  }
  return true;
}

void BlockCholesky::solve(Eigen::VectorXd& rhs) {
  CHECK(rhs.size() == 6 * static_cast<Eigen::Index>(size_));
  permuted_.resize(rhs.size());
  const auto at = [&](std::uint32_t row) { return permuted_.segment<6>(6 * row); };
  for (std::uint32_t i = 0; i < size_; ++i) at(position_[i]) = rhs.segment<6>(6 * i);
  for (std::uint32_t j = 0; j < size_; ++j) {
    diagonal_[j].triangularView<Eigen::Lower>().solveInPlace(at(j));
    for (auto k = column_begin_[j]; k < column_begin_[j + 1]; ++k) {
      at(row_[k]).noalias() -= below_[k].topRows<6>() * at(j);
    }
  }
  for (std::uint32_t j = size_; j-- > 0;) {
    for (auto k = column_begin_[j]; k < column_begin_[j + 1]; ++k) {
      at(j).noalias() -= below_[k].topRows<6>().transpose() * at(row_[k]);
    }
    diagonal_[j].transpose().triangularView<Eigen::Upper>().solveInPlace(at(j));
  }
  for (std::uint32_t i = 0; i < size_; ++i) rhs.segment<6>(6 * i) = at(position_[i]);
}

}  // namespace ygslam
