#include "geometry/se3.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

TEST(SE3, ExpIsContinuousAcrossTheSmallAngleBranch) {
  const Vec3 axis = Vec3(1, 2, 3).normalized();
  Vec6 below, above;
  below << 1, 2, 3, 0.9999e-5 * axis;
  above << 1, 2, 3, 1.0001e-5 * axis;
  EXPECT_LT((SE3::exp(below).t() - SE3::exp(above).t()).norm(), 1e-8);
}

}  // namespace
}  // namespace ygslam
