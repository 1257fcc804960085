#include "optim/block_cholesky.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "core/rng.hpp"
#include "optim/pose_block_system.hpp"

namespace ygslam {
namespace {

// A chain, and as many other pairs again as the share says.
struct BlockCase {
  std::vector<PosePair> pairs;
  std::vector<PoseBlock> blocks;
  Eigen::MatrixXd A;
};

BlockCase block_case(std::uint32_t poses, double share, Rng& rng) {
  BlockCase c;
  c.A.setZero(6 * poses, 6 * poses);
  for (std::uint32_t column = 0; column < poses; ++column) {
    for (std::uint32_t row = 0; row <= column; ++row) {
      if (row + 1 < column && rng.uniform() >= share) continue;
      PoseBlock block = PoseBlock::Constant(std::nan(""));  // the padding is of no account
      for (int i = 0; i < 36; ++i) block(i % 6, i / 6) = rng.uniform(-1, 1);
      if (row == column) {
        const Mat6 B = block.topRows<6>();
        block.topRows<6>() = B + B.transpose() + 12.0 * poses * Mat6::Identity();
      }
      c.A.block<6, 6>(6 * row, 6 * column) = block.topRows<6>();
      c.A.block<6, 6>(6 * column, 6 * row) = block.topRows<6>().transpose();
      c.pairs.push_back({row, column});
      c.blocks.push_back(block);
    }
  }
  return c;
}

TEST(BlockCholesky, SolvesWhatTheDenseFactorisationSolves) {
  Rng rng(1);
  for (const std::uint32_t poses : {1u, 2u, 5u, 40u, 90u}) {
    for (const double share : {0.0, 0.05, 1.0}) {
      const BlockCase c = block_case(poses, share, rng);
      BlockCholesky cholesky;
      cholesky.analyze(static_cast<int>(poses), c.pairs);
      for (int again = 0; again < 2; ++again) {
        Eigen::VectorXd x(6 * poses);
        for (auto& value : x) value = rng.normal();
        const Eigen::VectorXd expected = c.A.llt().solve(x);
        ASSERT_TRUE(cholesky.factorize(c.blocks));
        cholesky.solve(x);
        EXPECT_LT((x - expected).norm(), 1e-12 * expected.norm()) << poses << " " << share;
      }
    }
  }
}

TEST(BlockCholesky, RefusesWhatIsNotPositiveDefiniteAndStopsAtTheFlag) {
  Rng rng(2);
  BlockCase c = block_case(20, 0.2, rng);
  BlockCholesky cholesky;
  cholesky.analyze(20, c.pairs);
  const std::atomic<bool> abort = true;
  EXPECT_FALSE(cholesky.factorize(c.blocks, &abort));
  EXPECT_TRUE(cholesky.factorize(c.blocks));
  for (std::size_t i = 0; i < c.pairs.size(); ++i) {
    if (c.pairs[i].row == 7 && c.pairs[i].column == 7) c.blocks[i](3, 3) = -1;
  }
  EXPECT_FALSE(cholesky.factorize(c.blocks));
}

TEST(PoseBlockSystem, KeepsAPairOnceAndSolvesInPlace) {
  PoseBlockSystem system;
  system.reset(3);
  EXPECT_EQ(system.add_pair(1, 1), 1u);
  EXPECT_EQ(system.add_pair(0, 2), system.add_pair(0, 2));
  system.freeze();
  EXPECT_EQ(system.blocks(), 4u);
  for (std::uint32_t i = 0; i < 3; ++i) system.diagonal(i).topRows<6>() = 2 * Mat6::Identity();
  system.block(3).topRows<6>() = Mat6::Identity();
  Eigen::VectorXd x = Eigen::VectorXd::Ones(18);
  ASSERT_TRUE(system.solve(x));
  const Eigen::VectorXd expected =
      (Eigen::VectorXd(18) << Vec6::Constant(1.0 / 3), Vec6::Constant(0.5), Vec6::Constant(1.0 / 3))
          .finished();
  EXPECT_LT((x - expected).norm(), 1e-15);
  x[0] = std::nan("");
  EXPECT_FALSE(system.solve(x));
}

}  // namespace
}  // namespace ygslam
