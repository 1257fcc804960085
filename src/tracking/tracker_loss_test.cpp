// A tracker that loses its way: weak poses, losses, places found again, submaps.
#include <gtest/gtest.h>

#include "tracking/tracker_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::PaintedWall;
using tracking_test::TrackerTest;

TEST_F(TrackerTest, FewPointsMakeAPoseWeakAndManyFramesOfThemLost) {
  make(many_inliers());
  start();
  TrackResult result = see(kFew);
  ASSERT_EQ(result.state, TrackState::kWeak);
  EXPECT_LT(result.inliers, many_inliers().judge.min_inliers);
  EXPECT_GE(result.inliers, many_inliers().judge.least_inliers());
  EXPECT_NEAR(x_m(result), 0, 0.02);
  int weak = 0;
  for (; result.state == TrackState::kWeak && weak < 50; ++weak) {
    EXPECT_FALSE(result.candidate) << "a weak pose is not mapped";
    result = see(kFew);
  }
  EXPECT_EQ(result.state, TrackState::kLost);
  EXPECT_EQ(weak, TrackJudgeConfig{}.weak_frames_until_lost);
}

TEST_F(TrackerTest, AWeakPoseThatJumpsIsLostAndAStrongOneIsNot) {
  make(many_inliers());
  start();
  EXPECT_EQ(see({.left_px = 20}).state, TrackState::kTracking) << "0.15 m in a frame";
  for (int i = 0; i < kSettled; ++i) see({.left_px = 20});
  ASSERT_EQ(see({.left_px = 20, .painted_px = kFew.painted_px}).state, TrackState::kWeak);
  EXPECT_EQ(see(kFew).state, TrackState::kLost) << "0.15 m back";
}

TEST_F(TrackerTest, APlaceFoundAgainMustProveItselfWithMorePoints) {
  make(many_inliers());
  start();
  const TrackResult tracked = see(kEnough);
  ASSERT_EQ(tracked.state, TrackState::kTracking);
  ASSERT_LT(tracked.inliers, 1.67 * many_inliers().judge.min_inliers);
  ASSERT_EQ(see_nothing().state, TrackState::kLost);
  EXPECT_EQ(see(kEnough).state, TrackState::kLost);
  ASSERT_EQ(see({}).state, TrackState::kTracking);
  EXPECT_EQ(see(kEnough).state, TrackState::kLost) << "within ten frames";
  ASSERT_EQ(see({}).state, TrackState::kTracking);
  for (int i = 0; i < 10; ++i) ASSERT_EQ(see({}).state, TrackState::kTracking);
  EXPECT_EQ(see(kEnough).state, TrackState::kTracking) << "after ten";
}

TEST_F(TrackerTest, ALostCameraIsFoundWhereItIsAndOdometryStaysBehind) {
  start();
  ASSERT_EQ(see_nothing().state, TrackState::kLost);
  const TrackResult lost = see_nothing();
  EXPECT_EQ(lost.state, TrackState::kLost);
  EXPECT_LT(lost.T_odom_camera.log().norm(), 0.01);
  EXPECT_FALSE(lost.covariance);
  const TrackResult found = see({.left_px = 50});
  ASSERT_EQ(found.state, TrackState::kTracking);
  EXPECT_NEAR(x_m(found), PaintedWall::metres(50), 0.02);
  EXPECT_LT(found.T_odom_camera.log().norm(), 0.01) << "odom never jumps";
  EXPECT_NEAR(found.correction_m, PaintedWall::metres(50), 0.03);
  EXPECT_FALSE(found.candidate) << "it must prove itself before it is mapped";
}

TEST_F(TrackerTest, WhatTheLastFrameDidNotShowIsFoundByKeyframes) {
  make(many_inliers());
  start();
  ASSERT_EQ(see(kEnough).state, TrackState::kTracking);
  ASSERT_EQ(see_nothing().state, TrackState::kLost);
  const TrackResult found = see({.left_px = 75});  // nothing of the strip that was seen last
  ASSERT_EQ(found.state, TrackState::kTracking);
  EXPECT_NEAR(x_m(found), PaintedWall::metres(75), 0.02);
}

TEST_F(TrackerTest, AfterALossTheLastFrameAloneVouchesForNothing) {
  start();
  auto unmapped = std::make_shared<LocalView>(*map_.view());
  unmapped->landmarks.clear();
  unmapped->landmark_index.clear();
  for (auto& landmark : unmapped->keyframes.front().landmarks) landmark = -1;
  const auto step = [&](const PaintedWall::View& view) {
    return tracker_->step(wall_.see(number_++, view), unmapped, {}, false).state;
  };
  EXPECT_EQ(step({}), TrackState::kTracking) << "from frame to frame it does";
  EXPECT_EQ(step({.painted_px = 0}), TrackState::kLost);
  EXPECT_EQ(step({}), TrackState::kLost);
}

TEST_F(TrackerTest, WhereItCannotHaveComeByItselfASubmapBegins) {
  start();
  ASSERT_EQ(see_nothing().state, TrackState::kLost);
  const TrackResult found = see({.left_px = 130});  // a metre in a tenth of a second
  ASSERT_EQ(found.state, TrackState::kTracking);
  EXPECT_TRUE(found.provisional);
  ASSERT_TRUE(found.candidate);
  EXPECT_EQ(found.candidate->submap_reach_m, 0) << "known by appearance alone";
  for (const LandmarkId id : found.candidate->landmarks) EXPECT_EQ(id, kNoLandmark);
  const TrackResult inside = see({.left_px = 130});
  ASSERT_EQ(inside.state, TrackState::kTracking);
  EXPECT_TRUE(inside.unplaced);
}

TEST_F(TrackerTest, WithoutSubmapsWhereItCannotHaveComeIsOnlyDoubtful) {
  TrackerConfig config;
  config.starts_submaps = false;
  make(config);
  start();
  ASSERT_EQ(see_nothing().state, TrackState::kLost);
  const TrackResult found = see({.left_px = 130});
  ASSERT_EQ(found.state, TrackState::kTracking);
  EXPECT_TRUE(found.provisional);
  EXPECT_FALSE(found.candidate);
  for (int i = 0; i <= kSecond; ++i) EXPECT_FALSE(see_elsewhere().candidate);
}

TEST_F(TrackerTest, ALostCameraThatSeesSomethingElseForASecondBeginsASubmap) {
  start();
  int frames = 0;
  TrackResult lost;
  do {
    lost = see_elsewhere();
    ASSERT_EQ(lost.state, TrackState::kLost);
  } while (!lost.candidate && ++frames < 100);
  EXPECT_EQ(frames, kSecond);
  ASSERT_TRUE(lost.candidate);
  ASSERT_TRUE(lost.candidate->submap_reach_m);
  EXPECT_NEAR(*lost.candidate->submap_reach_m, 0.5 + (kSecond + 1) * PaintedWall::kFrame_s, 1e-6);
  const TrackResult next = see_elsewhere({.left_px = 3});
  ASSERT_EQ(next.state, TrackState::kTracking);
  EXPECT_TRUE(next.unplaced);
  EXPECT_TRUE(next.provisional);
}

TEST_F(TrackerTest, ASecondOfLossIsCountedFromTheLastPose) {
  start();
  for (int i = 0; i < kSecond; ++i) ASSERT_FALSE(see_elsewhere().candidate) << i;
  ASSERT_EQ(see({}).state, TrackState::kTracking);
  for (int i = 0; i < kSecond; ++i) ASSERT_FALSE(see_elsewhere().candidate) << i;
  EXPECT_TRUE(see_elsewhere().candidate);
}

TEST_F(TrackerTest, ACoveredLensIsNoStartOfASubmap) {
  start();
  for (int i = 0; i <= kSecond; ++i) {
    const TrackResult covered = see_elsewhere({.depth_m = 0.4F});
    ASSERT_EQ(covered.state, TrackState::kLost);
    ASSERT_FALSE(covered.candidate) << i;
  }
  EXPECT_EQ(see({}).state, TrackState::kTracking);
}

TEST_F(TrackerTest, ARunInAMapIsFoundThereOrBeginsASubmap) {
  start();
  const int in_map = number_ + 100;
  make({});
  EXPECT_EQ(tracker_->step(wall_.see(in_map, {.painted_px = 0}), map_.view(), {}, false).state,
            TrackState::kLost);
  const TrackResult found =
      tracker_->step(wall_.see(in_map + 1, {.left_px = 30}), map_.view(), {}, false);
  ASSERT_EQ(found.state, TrackState::kTracking);
  EXPECT_NEAR(x_m(found), PaintedWall::metres(30), 0.02);
  EXPECT_TRUE(found.provisional) << "another room may look the same";
  EXPECT_FALSE(found.candidate);
  make({});
  int frames = 0;
  TrackResult lost;
  do {
    lost = tracker_->step(elsewhere_.see(in_map + frames, {}), map_.view(), {}, false);
    ASSERT_EQ(lost.state, TrackState::kLost);
  } while (!lost.candidate && ++frames < 100);
  EXPECT_EQ(frames, kSecond);
  EXPECT_EQ(lost.candidate->submap_reach_m, 0);
}

}  // namespace
}  // namespace ygslam
