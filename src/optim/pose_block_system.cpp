#include "optim/pose_block_system.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "core/check.hpp"

namespace ygslam {

void PoseBlockSystem::reset(int poses) {
  poses_ = poses;
  pairs_.clear();
  index_of_pair_.clear();
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(poses); ++i) pairs_.push_back({i, i});
}

std::uint32_t PoseBlockSystem::add_pair(std::uint32_t row, std::uint32_t column) {
  CHECK(row <= column && column < static_cast<std::uint32_t>(poses_));
  if (row == column) return row;
  const std::uint64_t key = (static_cast<std::uint64_t>(row) << 32) | column;
  const auto [entry, is_new] =
      index_of_pair_.try_emplace(key, static_cast<std::uint32_t>(pairs_.size()));
  if (is_new) pairs_.push_back({row, column});
  return entry->second;
}

void PoseBlockSystem::freeze() {
  blocks_.resize(pairs_.size());
  const int n = 6 * poses_;
  if (is_dense()) {
    dense_.setZero(n, n);
    return;
  }
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(36 * pairs_.size());
  for (const Pair& p : pairs_) {
    for (int c = 0; c < 6; ++c) {
      for (int r = 0; r < 6; ++r) {
        if (p.row == p.column && r > c) continue;
        entries.emplace_back(6 * static_cast<int>(p.column) + c, 6 * static_cast<int>(p.row) + r,
                             0.0);
      }
    }
  }
  sparse_.resize(n, n);
  sparse_.setFromTriplets(entries.begin(), entries.end());
  factor_.analyzePattern(sparse_);
  sparse_entry_.assign(36 * pairs_.size(), nullptr);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& p = pairs_[k];
    for (int c = 0; c < 6; ++c) {
      for (int r = 0; r < (p.row == p.column ? c + 1 : 6); ++r) {
        sparse_entry_[36 * k + 6 * c + r] =
            &sparse_.coeffRef(6 * static_cast<int>(p.column) + c, 6 * static_cast<int>(p.row) + r);
      }
    }
  }
}

void PoseBlockSystem::set_zero() {
  for (PoseBlock& block : blocks_) block.setZero();
}

bool PoseBlockSystem::solve(Eigen::VectorXd& rhs) {
  return (is_dense() ? solve_dense(rhs) : solve_sparse(rhs)) && rhs.allFinite();
}

bool PoseBlockSystem::solve_dense(Eigen::VectorXd& rhs) {
  dense_.setZero();
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& p = pairs_[k];
    for (int c = 0; c < 6; ++c) {
      for (int r = 0; r < 6; ++r) {
        dense_(6 * p.column + c, 6 * p.row + r) = blocks_[k](r, c);
      }
    }
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(dense_);
  if (factor.info() != Eigen::Success) return false;
  factor.solveInPlace(rhs);
  return true;
}

bool PoseBlockSystem::solve_sparse(Eigen::VectorXd& rhs) {
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    for (int c = 0; c < 6; ++c) {
      for (int r = 0; r < 6; ++r) {
        double* entry = sparse_entry_[36 * k + 6 * c + r];
        if (entry != nullptr) *entry = blocks_[k](r, c);
      }
    }
  }
  factor_.factorize(sparse_);
  if (factor_.info() != Eigen::Success) return false;
  rhs = factor_.solve(rhs).eval();
  return true;
}

}  // namespace ygslam
