#include "tracking/keyframe_policy.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

const KeyframePolicyConfig kConfig;

/// A frame well tracked, just after a keyframe, camera at rest, where it was a minute ago.
KeyframeEvidence content() {
  KeyframeEvidence e;
  e.frames_since_last = 5;
  e.tracked_landmarks = 300;
  e.reference_landmarks = 300;
  e.close_tracked = 300;
  e.close_untracked = 20;
  e.nearest_age_s = 60;
  return e;
}

SE3 moved(double metres) { return SE3(Mat3::Identity(), Vec3(metres, 0, 0)); }
SE3 turned(double radians) { return SE3(so3_exp(Vec3(0, radians, 0)), Vec3::Zero()); }

TEST(KeyframePolicy, AContentFrameMakesNone) {
  EXPECT_FALSE(wants_keyframe(content(), kConfig));
  KeyframeEvidence resting = content();
  resting.frames_since_last = 100000;
  EXPECT_FALSE(wants_keyframe(resting, kConfig)) << "a standing camera needs no more";
}

TEST(KeyframePolicy, FewTrackedAndManyNewNearPointsMakeOne) {
  KeyframeEvidence e = content();
  e.close_tracked = kConfig.min_close_tracked - 1;
  e.close_untracked = kConfig.min_close_untracked + 1;
  e.T_camera_nearest = moved(0.3);
  EXPECT_TRUE(wants_keyframe(e, kConfig));
  e.close_untracked = kConfig.min_close_untracked;
  EXPECT_FALSE(wants_keyframe(e, kConfig)) << "there is nothing to add";
}

TEST(KeyframePolicy, WhileAPlaceIsLookedAtAnotherKeyframeBesideTheLastHelps) {
  KeyframeEvidence due = content();
  due.frames_since_last = 2 * kConfig.max_interval_frames;
  due.T_camera_nearest = moved(0.1);
  EXPECT_FALSE(wants_keyframe(due, kConfig));
  due.nearest_age_s = 5;
  EXPECT_TRUE(wants_keyframe(due, kConfig));
}

TEST(KeyframePolicy, BesideAKeyframeAnotherWouldShowTheSame) {
  KeyframeEvidence starving = content();
  starving.close_tracked = kConfig.min_close_tracked - 1;
  starving.close_untracked = kConfig.min_close_untracked + 1;
  KeyframeEvidence due = content();
  due.frames_since_last = 2 * kConfig.max_interval_frames;
  for (KeyframeEvidence e : {starving, due}) {
    for (const SE3& T : {moved(0.15), turned(0.15)}) {
      e.T_camera_nearest = T;
      EXPECT_FALSE(wants_keyframe(e, kConfig));
    }
    for (const SE3& T : {moved(0.25), turned(0.25)}) {
      e.T_camera_nearest = T;
      EXPECT_TRUE(wants_keyframe(e, kConfig));
    }
  }
  // What the keyframes there saw has changed, or was hidden.
  starving.T_camera_nearest = moved(0.05);
  EXPECT_FALSE(wants_keyframe(starving, kConfig));
  starving.frames_since_last = 3 * kConfig.max_interval_frames;
  EXPECT_TRUE(wants_keyframe(starving, kConfig));
  starving.frames_since_last = kConfig.min_interval_frames;
  starving.tracked_landmarks = 100;
  EXPECT_TRUE(wants_keyframe(starving, kConfig));
}

TEST(KeyframePolicy, ThinningMatchesMakeOneOnceTheCameraMoved) {
  KeyframeEvidence e = content();
  e.tracked_landmarks = static_cast<int>(kConfig.tracked_ratio * e.reference_landmarks) - 1;
  EXPECT_FALSE(wants_keyframe(e, kConfig));
  e.T_camera_nearest = moved(kConfig.min_translation_m * 1.1);
  EXPECT_TRUE(wants_keyframe(e, kConfig));
  e.T_camera_nearest = turned(kConfig.min_rotation_rad * 1.1);
  EXPECT_TRUE(wants_keyframe(e, kConfig)) << "turning is moving";
  e.tracked_landmarks = e.reference_landmarks;
  EXPECT_FALSE(wants_keyframe(e, kConfig));
}

TEST(KeyframePolicy, AMovingCameraMakesOneEverySoOften) {
  KeyframeEvidence e = content();
  e.T_camera_nearest = moved(0.3);
  e.frames_since_last = kConfig.max_interval_frames;
  EXPECT_TRUE(wants_keyframe(e, kConfig));
  --e.frames_since_last;
  EXPECT_FALSE(wants_keyframe(e, kConfig));
}

TEST(KeyframePolicy, NeverTwoInShortOrder) {
  KeyframeEvidence e = content();
  e.close_tracked = 0;
  e.close_untracked = 1000;
  e.tracked_landmarks = 0;
  e.T_camera_nearest = moved(1);
  e.frames_since_last = kConfig.min_interval_frames - 1;
  EXPECT_FALSE(wants_keyframe(e, kConfig));
}

TEST(KeyframePolicy, ABusyMapperGetsOnlyWhatTrackingStarvesFor) {
  KeyframeEvidence due = content();
  due.T_camera_nearest = moved(0.3);
  due.frames_since_last = 10 * kConfig.max_interval_frames;
  due.mapper_busy = true;
  EXPECT_FALSE(wants_keyframe(due, kConfig));
  due.close_tracked = 0;
  due.close_untracked = 1000;
  EXPECT_TRUE(wants_keyframe(due, kConfig));
}

}  // namespace
}  // namespace ygslam
