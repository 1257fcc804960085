#include "geometry/small_systems.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"

namespace ygslam {
namespace {

template <int Rows>
Eigen::Matrix<double, Rows, Rows> random_matrix(Rng& rng) {
  Eigen::Matrix<double, Rows, Rows> A;
  for (int i = 0; i < Rows; ++i)
    for (int k = 0; k < Rows; ++k) A(i, k) = rng.uniform(-1, 1);
  return A;
}

TEST(SmallSystems, SymmetricSystemsAreSolvedAndInverted) {
  Rng rng(1);
  for (int round = 0; round < 50; ++round) {
    const Mat6 root = random_matrix<6>(rng);
    const Mat6 A = root * root.transpose() + 0.1 * Mat6::Identity();
    const Vec6 x = random_matrix<6>(rng).col(0);
    const SymmetricSystem6 system(A);
    EXPECT_TRUE(system.is_decomposed());
    EXPECT_TRUE(system.is_positive());
    EXPECT_LT((system.solve(A * x) - x).norm(), 1e-10);
    EXPECT_LT((system.inverse() * A - Mat6::Identity()).norm(), 1e-9);
  }
}

TEST(SmallSystems, AnIndefiniteMatrixIsNotPositiveAndSolvedAllTheSame) {
  Vec6 pivots;
  pivots << 3, 2, 1, 1, 1, -1;
  const SymmetricSystem6 system(pivots.asDiagonal());
  EXPECT_FALSE(system.is_positive());
  EXPECT_LT((system.solve(pivots) - Vec6::Ones()).norm(), 1e-12);
}

TEST(SmallSystems, DecompositionsOfThreeByThreeGiveTheMatrixBack) {
  Rng rng(2);
  for (int round = 0; round < 50; ++round) {
    const Mat3 A = random_matrix<3>(rng);
    const Svd3 parts = svd(A);
    EXPECT_LT((parts.U * parts.s.asDiagonal() * parts.V.transpose() - A).norm(), 1e-12);
    EXPECT_LT((parts.U.transpose() * parts.U - Mat3::Identity()).norm(), 1e-12);
    EXPECT_LT((parts.V.transpose() * parts.V - Mat3::Identity()).norm(), 1e-12);
    EXPECT_TRUE(parts.s[0] >= parts.s[1] && parts.s[1] >= parts.s[2] && parts.s[2] >= 0);

    const Mat3 S = A + A.transpose();
    const SymmetricEigen3 eigen = symmetric_eigen(S);
    EXPECT_LT((S * eigen.vectors - eigen.vectors * eigen.values.asDiagonal()).norm(), 1e-12);
    EXPECT_TRUE(eigen.values[0] <= eigen.values[1] && eigen.values[1] <= eigen.values[2]);
  }
}

}  // namespace
}  // namespace ygslam
