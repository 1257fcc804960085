#include "inertial/turn_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "geometry/smooth_turns.hpp"

namespace ygslam {
namespace {

constexpr double kDistance_m = 3, kStd_rad = 1e-3, kTurnStd_rad = 5e-5;

/// Of a camera that takes a turn for a shift of points at a distance.
Mat6 coupled_covariance() {
  Mat6 covariance = 1e-6 * Mat6::Identity();
  Eigen::Matrix<double, 6, 3> by_turn = Eigen::Matrix<double, 6, 3>::Zero();
  by_turn(0, 1) = -kDistance_m;
  by_turn(1, 0) = kDistance_m;
  by_turn.bottomRows<3>().setIdentity();
  return covariance + kStd_rad * kStd_rad * by_turn * by_turn.transpose();
}

/// A joint update as in a textbook: the pose of the points, and the rotation alone as predicted.
TEST(TurnFilter, MovesAPoseAsItsCovarianceSays) {
  const Mat6 covariance = coupled_covariance();
  const Vec3 turn_rad(0.01, -0.02, 0.005), wrong_rad(4e-4, -3e-4, 2e-4);
  TurnFilter filter;
  const SE3 first(so3_exp(Vec3(0.1, 0.2, -0.3)), Vec3(1, 2, 3));
  EXPECT_LT(filter.step(first, covariance, std::nullopt).log().norm(), 1e-12);
  const SE3 second(first.R() * so3_exp(turn_rad) * so3_exp(wrong_rad), Vec3(1.01, 2, 3));
  const Vec6 moved = filter.step(second, covariance, HeldTurn{turn_rad, kTurnStd_rad}).log();

  const Mat6 R = kLastingFactor * kLastingFactor * covariance;
  Mat3 prior = R.bottomRightCorner<3, 3>();
  prior.diagonal().array() += kTurnStd_rad * kTurnStd_rad;
  const Mat3 innovation = R.bottomRightCorner<3, 3>() + prior;
  const Vec6 expected = -R.rightCols<3>() * innovation.ldlt().solve(wrong_rad);
  EXPECT_LT((moved - expected).norm(), 0.01 * expected.norm());
}

TEST(TurnFilter, ThePointsWinOverAGyroscopeOfAWrongScale) {
  TurnFilter filter;
  Mat3 R = Mat3::Identity();
  const Vec3 turn_rad(0, 0.03, 0);
  double most_rad = 0;
  for (int i = 0; i < 300; ++i) {
    const SE3 off = filter.step({R, Vec3::Zero()}, coupled_covariance(),
                                HeldTurn{1.02 * turn_rad, kTurnStd_rad});
    most_rad = std::max(most_rad, off.angle());
    R = R * so3_exp(turn_rad);
  }
  EXPECT_LT(most_rad, 5.1 * kStd_rad * std::sqrt(2.0));
}

TEST(TurnFilter, StartsAnewWhereNoTurnIsKnown) {
  TurnFilter filter;
  (void)filter.step({}, coupled_covariance(), std::nullopt);
  const SE3 off(so3_exp(Vec3(1e-3, 0, 0)), Vec3::Zero());
  EXPECT_GT(filter.step(off, coupled_covariance(), HeldTurn{Vec3::Zero(), kTurnStd_rad}).angle(),
            1e-4);
  EXPECT_EQ(filter.step(off, coupled_covariance(), std::nullopt).angle(), 0);
}

}  // namespace
}  // namespace ygslam
