#include "optim/pose_block_system.hpp"

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
  blocks_.assign(pairs_.size(), PoseBlock::Zero());
  factor_.analyze(poses_, pairs_);
}

void PoseBlockSystem::set_zero() {
  for (PoseBlock& block : blocks_) block.setZero();
}

bool PoseBlockSystem::solve(Eigen::VectorXd& rhs, const std::atomic<bool>* abort) {
  if (!factor_.factorize(blocks_, abort)) return false;
  factor_.solve(rhs);
  return rhs.allFinite();
}

}  // namespace ygslam
