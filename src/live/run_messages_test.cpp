#include "live/run_messages.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/rng.hpp"

namespace ygslam {
namespace {

SE3 pose_of(const ros::Pose& pose) {
  const auto& [p, q] = pose;
  return SE3(Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix(), Vec3(p.x, p.y, p.z));
}

/// Nearly normal: the sum of twelve.
double normal(Rng& rng) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += rng.below(1U << 30U) / static_cast<double>(1U << 30U);
  return sum;
}

TEST(RunMessages, CovarianceIsThatOfThePoseInTheAxesOfOdom) {
  Rng rng(5);
  Mat6 root;
  for (double& entry : root.reshaped()) entry = 1e-3 * normal(rng);
  TrackResult result;
  result.state = TrackState::kTracking;
  result.T_odom_camera = SE3::exp((Vec6() << 0.4, -0.2, 1.1, 0.6, -1.1, 0.3).finished());
  result.covariance = root * root.transpose();
  const RgbdFrame frame;
  const ros::Odometry told = odometry_message(frame, result);
  const SE3 T_odom_camera = pose_of(told.pose);

  Mat6 seen = Mat6::Zero();
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    Vec6 unit;
    for (double& entry : unit) entry = normal(rng);
    TrackResult other = result;
    other.T_odom_camera = (SE3::exp(root * unit) * result.T_odom_camera.inverse()).inverse();
    const SE3 T = pose_of(odometry_message(frame, other).pose);
    const Eigen::AngleAxisd turn(T.R() * T_odom_camera.R().transpose());  // about odom's axes
    Vec6 error;
    error << T.t() - T_odom_camera.t(), turn.angle() * turn.axis();
    seen += error * error.transpose() / kSamples;
  }
  const Eigen::Map<const Mat6> covariance(told.pose_covariance.data());  // symmetric
  EXPECT_LT((covariance - seen).norm(), 0.03 * seen.norm());
  EXPECT_EQ(told.twist_covariance[0], kUnknownVariance);
  EXPECT_EQ(told.header.frame_id, "odom");
}

TEST(RunMessages, WhatIsNotKnownSaysSo) {
  TrackResult lost;
  lost.state = TrackState::kLost;
  EXPECT_EQ(odometry_message({}, lost).pose_covariance[35], kUnknownVariance);
  EXPECT_EQ(tf_message({}, lost).transforms.front().header.frame_id, "odom") << "no map -> odom";
  TrackResult first;
  first.state = TrackState::kTracking;
  EXPECT_EQ(odometry_message({}, first).pose_covariance[0], 0) << "the origin itself";
}

TEST(RunMessages, AxesAreThoseOfRep103) {
  TrackResult result;
  result.state = TrackState::kTracking;
  result.T_odom_camera = SE3(Mat3::Identity(), Vec3(1, 2, 3));  // right, down, forward
  const ros::TfMessage tf = tf_message({}, result);
  ASSERT_EQ(tf.transforms.size(), 3U);
  const ros::Pose& camera = tf.transforms[1].transform;
  EXPECT_DOUBLE_EQ(camera.position.x, 3);
  EXPECT_DOUBLE_EQ(camera.position.y, -1);
  EXPECT_DOUBLE_EQ(camera.position.z, -2);
  // A point ahead in the image's axes lies on x of the camera's body.
  const Vec3 ahead = pose_of(tf.transforms[2].transform) * Vec3(0, 0, 1);
  EXPECT_NEAR((ahead - Vec3(1, 0, 0)).norm(), 0, 1e-12);
}

}  // namespace
}  // namespace ygslam
