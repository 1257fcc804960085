#include "system/pose_covariance.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

TrackResult tracked(TrackState state) {
  TrackResult result;
  result.state = state;
  result.matches = 100;
  result.T_odom_camera = SE3::exp((Vec6() << 1, 2, 3, 0.4, -0.5, 0.6).finished());
  Mat6 root = Mat6::Random();
  result.covariance = 1e-4 * root * root.transpose();
  return result;
}

TEST(PoseCovariance, IsTurnedIntoTheAxesOfOdom) {
  TrackResult result = tracked(TrackState::kTracking);
  const Mat6 odom = odom_covariance(result);
  const Mat3 R = result.T_odom_camera.R();
  EXPECT_LT(
      (odom.topLeftCorner<3, 3>() - R * result.covariance->topLeftCorner<3, 3>() * R.transpose())
          .norm(),
      1e-12);
  EXPECT_NEAR(odom.trace(), result.covariance->trace(), 1e-12);
}

TEST(PoseCovariance, GrowsWhileWeakAndIsUnknownWithoutAPose) {
  TrackResult result = tracked(TrackState::kTracking);
  const Mat6 sure = odom_covariance(result);
  result.state = TrackState::kWeak;
  EXPECT_NEAR(odom_covariance(result).trace(), 9 * sure.trace(), 1e-9);
  result.state = TrackState::kLost;
  EXPECT_EQ(odom_covariance(result)(5, 5), kUnknownVariance);
  result.state = TrackState::kTracking;
  result.covariance.reset();
  EXPECT_EQ(odom_covariance(result)(0, 0), kUnknownVariance) << "its points leave it open";
  result.matches = 0;
  EXPECT_EQ(odom_covariance(result)(0, 0), 0) << "the origin itself";
}

}  // namespace
}  // namespace ygslam
