#include "geometry/se3.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"

namespace ygslam {
namespace {

Vec6 random_twist(Rng& rng, double scale) {
  Vec6 v;
  for (int i = 0; i < 6; ++i) v[i] = rng.uniform(-scale, scale);
  return v;
}

TEST(SE3, LogInvertsExp) {
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    const double scale = i % 3 == 0 ? 1e-7 : (i % 3 == 1 ? 1e-2 : 1.7);
    const Vec6 twist = random_twist(rng, scale);
    EXPECT_LT((SE3::exp(twist).log() - twist).norm(), 1e-9 * (1 + twist.norm()));
  }
}

TEST(SE3, InverseUndoesPose) {
  Rng rng(2);
  for (int i = 0; i < 100; ++i) {
    const SE3 T = SE3::exp(random_twist(rng, 2));
    EXPECT_LT((T * T.inverse()).log().norm(), 1e-12);
    const Vec3 p(rng.normal(), rng.normal(), rng.normal());
    EXPECT_LT((T.inverse() * (T * p) - p).norm(), 1e-12);
  }
}

TEST(SE3, AdjointMovesTwistAcross) {
  Rng rng(3);
  for (int i = 0; i < 100; ++i) {
    const SE3 T = SE3::exp(random_twist(rng, 1));
    const Vec6 xi = random_twist(rng, 0.5);
    EXPECT_LT((SE3::exp(T.adjoint() * xi).log() - (T * SE3::exp(xi) * T.inverse()).log()).norm(),
              1e-9);
  }
}

TEST(SE3, ExpIsContinuousAcrossTheSmallAngleBranch) {
  const Vec3 axis = Vec3(1, 2, 3).normalized();
  Vec6 below, above;
  below << 1, 2, 3, 0.9999e-5 * axis;
  above << 1, 2, 3, 1.0001e-5 * axis;
  EXPECT_LT((SE3::exp(below).t() - SE3::exp(above).t()).norm(), 1e-8);
}

}  // namespace
}  // namespace ygslam
