#include "tracking/track_judge.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace ygslam {
namespace {

using enum TrackState;

constexpr TrackJudgeConfig kLimits;
constexpr int kMany = 100;
constexpr int kFew = 20;       // weak
constexpr int kMiddling = 40;  // enough, but no proof

std::optional<PoseResult> pose_of(int inliers, double position_std_m = 0.001) {
  PoseResult pose;
  pose.inliers = inliers;
  pose.position_std_m = position_std_m;
  return pose;
}

/// One that tracks.
TrackJudge tracking() {
  TrackJudge judge(kLimits);
  judge.start();
  return judge;
}

TEST(TrackJudge, ManyCertainPointsTrackFewAreWeakFewerLost) {
  EXPECT_EQ(TrackJudge(kLimits).state(), kWaiting);
  EXPECT_EQ(tracking().state(), kTracking);
  EXPECT_EQ(tracking().next_state(pose_of(kLimits.min_inliers), {}), kTracking);
  EXPECT_EQ(tracking().next_state(pose_of(kLimits.min_inliers - 1), {}), kWeak);
  EXPECT_EQ(tracking().next_state(pose_of(kLimits.min_inliers / 2), {}), kWeak);
  EXPECT_EQ(tracking().next_state(pose_of(kLimits.min_inliers / 2 - 1), {}), kLost);
  EXPECT_EQ(tracking().next_state(std::nullopt, {}), kLost);
}

TEST(TrackJudge, APoseWithARivalIsWeakHoweverManyPointsItHas) {
  auto pose = pose_of(kMany);
  pose->contested = true;
  TrackJudge judge = tracking();
  EXPECT_EQ(judge.next_state(pose, {}), kWeak);
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}), kTracking);
}

TEST(TrackJudge, AnUncertainPlaceIsWeakAMoreUncertainOneLost) {
  EXPECT_EQ(tracking().next_state(pose_of(kMany, kLimits.weak_position_std_m), {}), kTracking);
  EXPECT_EQ(tracking().next_state(pose_of(kMany, 1.01 * kLimits.weak_position_std_m), {}), kWeak);
  EXPECT_EQ(tracking().next_state(pose_of(kMany, kLimits.lost_position_std_m), {}), kWeak);
  EXPECT_EQ(tracking().next_state(pose_of(kMany, 1.01 * kLimits.lost_position_std_m), {}), kLost);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(tracking().next_state(pose_of(kMany, kNan), {}), kLost);
  auto broken = pose_of(kMany);
  broken->T_camera_world = SE3(Mat3::Identity(), Vec3(kNan, 0, 0));
  EXPECT_EQ(tracking().next_state(broken, {}), kLost);
}

TEST(TrackJudge, WeakForTooLongIsLostUnlessAGoodFrameComesBetween) {
  TrackJudge judge = tracking();
  for (int i = 0; i < kLimits.weak_frames_until_lost; ++i)
    ASSERT_EQ(judge.next_state(pose_of(kFew), {}), kWeak) << i;
  EXPECT_EQ(judge.next_state(pose_of(kFew), {}), kLost);
  TrackJudge saved = tracking();
  for (int i = 0; i < 3 * kLimits.weak_frames_until_lost; ++i) {
    const bool good = i % kLimits.weak_frames_until_lost == 0;
    ASSERT_EQ(saved.next_state(pose_of(good ? kMany : kFew), {}), good ? kTracking : kWeak) << i;
  }
}

TEST(TrackJudge, ManyPointsThatLeaveItUncertainMayBeWeakForLong) {
  TrackJudge judge = tracking();
  for (int i = 0; i < 5 * kLimits.weak_frames_until_lost; ++i)
    ASSERT_EQ(judge.next_state(pose_of(kMany, 0.05), {}), kWeak) << i;
}

TEST(TrackJudge, AWeakPoseMustLieWhereItWasExpected) {
  const PoseJump near{.from_prediction_m = 0.9 * kLimits.max_jump_m, .gap_s = 0.03};
  const PoseJump far{.from_prediction_m = 1.1 * kLimits.max_jump_m, .gap_s = 0.03};
  EXPECT_EQ(tracking().next_state(pose_of(kFew), near), kWeak);
  EXPECT_EQ(tracking().next_state(pose_of(kFew), far), kLost);
  EXPECT_EQ(tracking().next_state(pose_of(kMany, 0.05), far), kLost) << "uncertain by its weights";
  EXPECT_EQ(tracking().next_state(pose_of(kMany), far), kTracking) << "many points vouch for it";
  PoseJump long_ago = far;
  long_ago.gap_s = 0.5;
  EXPECT_EQ(tracking().next_state(pose_of(kFew), long_ago), kWeak) << "a camera moves meanwhile";
  long_ago.from_prediction_m = 0.6;
  EXPECT_EQ(tracking().next_state(pose_of(kFew), long_ago), kLost);
}

TEST(TrackJudge, WhatIsFoundAfterALossMustProveItselfForTenFrames) {
  TrackJudge judge = tracking();
  ASSERT_EQ(judge.next_state(pose_of(kMiddling), {}), kTracking);
  ASSERT_EQ(judge.next_state(std::nullopt, {}), kLost);
  EXPECT_EQ(judge.next_state(pose_of(kMiddling), {}), kLost);
  EXPECT_EQ(judge.next_state(pose_of(51), {}), kTracking);
  for (int i = 1; i < 10; ++i) {
    TrackJudge proving = judge;
    EXPECT_EQ(proving.next_state(pose_of(kMiddling), {}), kLost) << i;
    ASSERT_EQ(judge.next_state(pose_of(kMany), {}), kTracking);
  }
  EXPECT_EQ(judge.next_state(pose_of(kMiddling), {}), kTracking);
}

TEST(TrackJudge, AfterALossOnlyTheLastPlaceVouchesForAnUncertainPose) {
  const auto found_at = [](double from_last_m) {
    TrackJudge judge = tracking();
    static_cast<void>(judge.next_state(std::nullopt, {}));
    return judge.next_state(pose_of(kMany, 0.05),
                            {.from_prediction_m = 0, .from_last_m = from_last_m, .gap_s = 10});
  };
  EXPECT_EQ(found_at(0.9 * kLimits.max_jump_m), kWeak);
  EXPECT_EQ(found_at(1.1 * kLimits.max_jump_m), kLost) << "however long ago it was";
}

TEST(TrackJudge, TheFirstFrameInAMapMustProveItselfToo) {
  TrackJudge judge(kLimits);
  EXPECT_FALSE(judge.start_in_map(std::nullopt));
  EXPECT_FALSE(judge.start_in_map(pose_of(kMiddling)));
  EXPECT_EQ(judge.state(), kWaiting);
  EXPECT_TRUE(judge.start_in_map(pose_of(kMany)));
  EXPECT_EQ(judge.state(), kTracking);
  EXPECT_EQ(judge.next_state(pose_of(kMiddling), {}), kLost) << "and so must those after it";
}

TEST(TrackJudge, StatesHaveNames) {
  EXPECT_STREQ(to_string(kWaiting), "waiting");
  EXPECT_STREQ(to_string(kTracking), "tracking");
  EXPECT_STREQ(to_string(kWeak), "weak");
  EXPECT_STREQ(to_string(kLost), "lost");
}

TEST(TrackJudge, AnImuCarriesOnAlsoWhereItsReadingsCameLate) {
  constexpr InertialVerdict kCarries{true, false, 0.01}, kExpected{true, true, 0.01};
  TrackJudge judge = tracking();
  EXPECT_EQ(judge.next_state(std::nullopt, {}, kCarries), kCoasting);
  EXPECT_EQ(judge.next_state(pose_of(5), {}, kExpected), kCoasting);
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}, kExpected), kTracking);
  EXPECT_EQ(judge.next_state(std::nullopt, {}, {}), kLost);
  EXPECT_EQ(judge.next_state(std::nullopt, {}, kCarries), kCoasting);
}

TEST(TrackJudge, APlaceThatAnImuPredictedNeedsNoProof) {
  constexpr InertialVerdict kCarries{true, false, 0.01}, kExpected{true, true, 0.01};
  TrackJudge expected = tracking(), elsewhere = tracking();
  static_cast<void>(expected.next_state(std::nullopt, {}, kCarries));
  static_cast<void>(elsewhere.next_state(std::nullopt, {}, kCarries));
  EXPECT_EQ(expected.next_state(pose_of(kMiddling), {}, kExpected), kTracking);
  EXPECT_EQ(elsewhere.next_state(pose_of(kMiddling), {}, kCarries), kCoasting);
  EXPECT_EQ(elsewhere.next_state(pose_of(kMany), {}, {true, false, 0.01}), kTracking);
}

// A white wall: a few points agree by chance, while the IMU knows to a centimetre.
TEST(TrackJudge, APoseThatKnowsLessThanAnImuEndsNoCoasting) {
  constexpr InertialVerdict kCarries{true, false, 0.01};
  auto weak = pose_of(kFew);
  weak->position_std_m = 0.02;
  TrackJudge judge = tracking();
  EXPECT_EQ(judge.next_state(weak, {}, {true, true, 0.01}), kWeak) << "vision goes on";
  static_cast<void>(judge.next_state(std::nullopt, {}, kCarries));
  for (int i = 0; i < 2 * kLimits.weak_frames_until_lost; ++i)
    ASSERT_EQ(judge.next_state(weak, {}, {true, true, 0.05}), kCoasting);
  auto many = pose_of(kMany);
  many->position_std_m = 0.02;
  EXPECT_EQ(judge.next_state(many, {}, {true, true, 0.01}), kCoasting) << "as do many";
  EXPECT_EQ(judge.next_state(weak, {}, {true, true, 0.07}), kWeak) << "by now it knows more";
}

TEST(TrackJudge, WhatAnImuContradictsIsOverruledUntilItAgrees) {
  constexpr InertialVerdict kSlightly{true, true, 0.01, 50}, kContradicts{true, false, 0.01, 200};
  TrackJudge judge = tracking();
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}, kSlightly), kTracking);
  EXPECT_FALSE(judge.has_overruled());
  EXPECT_EQ(judge.next_state(pose_of(kFew), {}, kSlightly), kCoasting) << "a weak one, sooner";
  EXPECT_TRUE(judge.has_overruled());
  EXPECT_FALSE(judge.went_along());
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}, kContradicts), kCoasting);
  EXPECT_EQ(judge.next_state(std::nullopt, {}, kContradicts), kCoasting);
  EXPECT_FALSE(judge.has_overruled()) << "there is none";
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}, kContradicts), kCoasting) << "the same again";
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}, {true, true, 0.01, 5}), kTracking);
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}, {false, false, 0.01, 200}), kTracking)
      << "one that may not stand for vision overrules nothing";
}

TEST(TrackJudge, ThePredictionOfBeforeContradictsWhatTheNewestWentAlongWith) {
  constexpr InertialVerdict kWentAlong{true, true, 0.01, 5, 200};
  TrackJudge judge = tracking();
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}, kWentAlong), kCoasting);
  EXPECT_TRUE(judge.went_along());
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}, {true, true, 0.01, 5, 5}), kTracking);
  EXPECT_FALSE(judge.went_along());
}

TEST(TrackJudge, AfterTheDarkTheMapKnowsBetterThanAnImu) {
  TrackJudge judge = tracking();
  EXPECT_EQ(judge.next_state(std::nullopt, {}, {true, false, 0.01}), kCoasting);
  EXPECT_EQ(judge.next_state(pose_of(kMany), {}, {true, false, 0.01, 200}), kTracking);
}

TEST(TrackJudge, AWeakPoseMayJumpToWhereAnImuPredictedIt) {
  const PoseJump far{2 * kLimits.max_jump_m, 0, 0.03};
  EXPECT_EQ(tracking().next_state(pose_of(kFew), far), kLost);
  EXPECT_EQ(tracking().next_state(pose_of(kFew), far, {true, true}), kWeak);
}

}  // namespace
}  // namespace ygslam
