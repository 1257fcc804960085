// The tracker's states, by views that are scripted: frames of a painted wall and a map of one page.
#include "tracking/tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tracking/tracking_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::dynamics_off;
using tracking_test::few_features;
using tracking_test::OnePageMap;
using tracking_test::PaintedWall;

/// A run of frames; whatever the tracker offers enters the map before the next frame.
class TrackerTest : public ::testing::Test {
 protected:
  TrackResult step(const FramePtr& frame) {
    TrackResult result = tracker_->step(frame, map_.view(), {}, false);
    if (result.candidate) map_.insert(*result.candidate);
    return result;
  }
  TrackResult see(const PaintedWall::View& view) { return step(wall_.see(number_++, view)); }
  TrackResult see_elsewhere(const PaintedWall::View& view = {}) {
    return step(elsewhere_.see(number_++, view));
  }
  TrackResult see_nothing() { return see({.painted_px = 0}); }
  void start() {
    ASSERT_EQ(see({}).state, TrackState::kTracking);
    for (int i = 0; i < kSettled; ++i) ASSERT_EQ(see({}).state, TrackState::kTracking);
  }
  void make(const TrackerConfig& config) {
    tracker_ = std::make_unique<Tracker>(config, few_features(), dynamics_off(), camera_, 0);
  }
  /// Of which the strips of the wall give too few, and almost enough.
  static TrackerConfig many_inliers() {
    TrackerConfig config;
    config.judge.min_inliers = 120;
    return config;
  }
  static constexpr PaintedWall::View kFew{.painted_px = 74}, kEnough{.painted_px = 90};
  static double x_m(const TrackResult& result) { return result.T_world_camera.t().x(); }

  static constexpr int kSettled = 3;  // frames, so that the camera is known to stand still
  static constexpr int kSecond = static_cast<int>(1 / PaintedWall::kFrame_s);
  Camera camera_{PaintedWall::camera()};
  PaintedWall wall_{7}, elsewhere_{8};
  OnePageMap map_{camera_};
  std::unique_ptr<Tracker> tracker_ =
      std::make_unique<Tracker>(TrackerConfig{}, few_features(), dynamics_off(), camera_, 0);
  int number_ = 0;
};

TEST_F(TrackerTest, WaitsForAFrameWithTextureAndDepth) {
  const TrackResult blank = see_nothing();
  EXPECT_EQ(blank.state, TrackState::kWaiting);
  EXPECT_FALSE(blank.candidate);
  EXPECT_EQ(see({.measured_px = 0}).state, TrackState::kWaiting) << "no depth";
  EXPECT_EQ(see({.measured_px = 10}).state, TrackState::kWaiting) << "too little depth";
  const TrackResult start = see({});
  ASSERT_EQ(start.state, TrackState::kTracking);
  EXPECT_GE(start.inliers, TrackerConfig{}.min_start_points);
  ASSERT_TRUE(start.candidate);
  EXPECT_EQ(start.candidate->pose.reference, kNoKeyframe);
  EXPECT_LT(start.T_world_camera.log().norm(), 1e-12) << "the first camera is the world";
  EXPECT_FALSE(start.covariance);
}

TEST_F(TrackerTest, StandsStillBeforeTheFirstViewAndIsLostWithoutAnImage) {
  const auto no_view = std::make_shared<LocalView>();
  const auto step = [&](const PaintedWall::View& view) {
    return tracker_->step(wall_.see(number_++, view), no_view, {}, false);
  };
  ASSERT_EQ(step({}).state, TrackState::kTracking);
  const TrackResult same = step({});
  ASSERT_EQ(same.state, TrackState::kTracking);
  EXPECT_LT(same.T_world_camera.log().norm(), 1e-3);
  const TrackResult blank = step({.painted_px = 0});
  EXPECT_EQ(blank.state, TrackState::kLost);
  EXPECT_FALSE(blank.candidate);
}

TEST_F(TrackerTest, FollowsTheWallAndOffersKeyframesOnTheWay) {
  start();
  int keyframes = 0;
  for (int px = 2; px <= 60; px += 2) {
    const TrackResult result = see({.left_px = px});
    ASSERT_EQ(result.state, TrackState::kTracking) << px;
    EXPECT_NEAR(x_m(result), PaintedWall::metres(px), 0.01) << px;
    EXPECT_FALSE(result.provisional);
    EXPECT_TRUE(result.covariance);
    EXPECT_GT(result.inliers, 100);
    EXPECT_EQ(result.landmarks.size(), result.features->size());
    EXPECT_EQ(result.pose.reference, KeyframeId{0});
    keyframes += result.candidate ? 1 : 0;
    if (result.candidate) break;
  }
  EXPECT_EQ(keyframes, 1) << "the wall that came into view is not in the map";
}

/// What ORB finds in a frame, as the tracker has it.
bool are_looked_for(const Features& features, const RgbdFrame& frame) {
  const Features found = OrbExtractor(few_features()).extract(frame.grey);
  return found.size() == features.size() &&
         std::ranges::equal(found.points, features.points,
                            [](const Feature& a, const Feature& b) { return a.uv_px == b.uv_px; });
}

TEST_F(TrackerTest, FollowedFramesAreAsGoodAndNoKeyframes) {
  TrackerConfig config;
  config.follow.max_frames = 3;
  DynamicConfig geometry;
  geometry.mode = DynamicMode::kGeometry;
  tracker_ = std::make_unique<Tracker>(config, few_features(), geometry, camera_, 0);
  start();
  int keyframes = 0, looked_for = 0, frames = 0;
  for (int px = 2; px <= 120; px += 2, ++frames) {
    const FramePtr frame = wall_.see(number_++, {.left_px = px});
    const TrackResult result = step(frame);
    ASSERT_EQ(result.state, TrackState::kTracking) << px;
    EXPECT_NEAR(x_m(result), PaintedWall::metres(px), 0.01) << px;
    EXPECT_EQ(result.landmarks.size(), result.features->size());
    const bool looked = are_looked_for(*result.features, *frame);
    looked_for += looked ? 1 : 0;
    if (!result.candidate) continue;
    ++keyframes;
    EXPECT_TRUE(looked) << "a keyframe's features are its own";
  }
  EXPECT_GE(keyframes, 2);
  EXPECT_LT(looked_for, frames / 2);
  EXPECT_GE(looked_for, frames / 4);
}

/// Letters over the upper part of the image, which stay where they are.
FramePtr with_text(const FramePtr& frame) {
  auto written = std::make_shared<RgbdFrame>(*frame);
  Rng rng(4);
  for (int square = 0; square < 1200; ++square) {
    const int u0 = 4 * static_cast<int>(rng.below(78)), v0 = 4 * static_cast<int>(rng.below(25));
    const auto grey = static_cast<std::uint8_t>(rng.below(2) == 0 ? 5 : 250);
    for (int v = v0; v < v0 + 4; ++v) std::fill_n(written->grey.row(v) + u0, 4, grey);
  }
  return written;
}

TEST_F(TrackerTest, WhatIsFixedToTheCameraMisleadsItForAMomentAndIsPutRight) {
  constexpr int kPerFrame_px = 7;
  const auto see_text = [&](int px) {
    return step(with_text(wall_.see(number_++, {.left_px = px})));
  };
  TrackResult result = see_text(0);
  std::map<FrameId, RetrackedFrame> again;
  bool grew = false;
  for (int i = 1; i <= 60; ++i) {
    result = see_text(kPerFrame_px * i);
    grew |= result.ego_mask_grew;
    for (const RetrackedFrame& frame : result.retracked) again[frame.frame] = frame;
  }
  ASSERT_TRUE(result.ego_mask);
  EXPECT_TRUE(grew);
  EXPECT_EQ(result.ego_mask, result.masked_pixels);
  for (const Feature& feature : result.features->points)
    EXPECT_EQ(result.ego_mask->at(static_cast<int>(std::lround(feature.uv_px.x())),
                                  static_cast<int>(std::lround(feature.uv_px.y()))),
              0);
  EXPECT_EQ(result.state, TrackState::kTracking);
  EXPECT_GT(again.size(), 10U);
}

TEST_F(TrackerTest, PixelsThatTheCameraFileNamesAreNotLookedAt) {
  CameraConfig config = PaintedWall::camera();
  config.ignored = {{0, 0, PaintedWall::kWidth_px, 101}};
  const Camera camera(config);
  Tracker tracker(TrackerConfig{}, few_features(), dynamics_off(), camera, 0);
  OnePageMap map(camera);
  for (int i = 0; i <= 20; ++i) {
    const int px = 3 * i;
    const TrackResult result =
        tracker.step(with_text(wall_.see(i, {.left_px = px})), map.view(), {}, false);
    ASSERT_EQ(result.state, TrackState::kTracking);
    EXPECT_NEAR(x_m(result), PaintedWall::metres(px), 0.01) << px;
    for (const Feature& feature : result.features->points) EXPECT_GT(feature.uv_px.y(), 101);
    if (!result.candidate) continue;
    EXPECT_EQ(result.candidate->frame->depth_m.at(50, 50), 0);
    EXPECT_GT(result.candidate->frame->depth_m.at(50, 150), 0);
    map.insert(*result.candidate);
  }
}

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

TEST_F(TrackerTest, AFrozenMapIsOfferedNothing) {
  start();
  TrackerConfig config;
  config.proposes_keyframes = false;
  make(config);
  for (int px = 0; px <= 100; px += 10) EXPECT_FALSE(see({.left_px = px}).candidate) << px;
  for (int i = 0; i <= kSecond; ++i) EXPECT_FALSE(see_elsewhere().candidate) << i;
}

/// Its rows take 20 of the 50 ms from frame to frame, or nobody knows how long.
class RollingTrackerTest : public TrackerTest {
 protected:
  static constexpr double kReadout_s = 0.02;
  static constexpr int kStep_px = 4;  // to the next frame
  void make_with(const CameraConfig& config) {
    camera_ = Camera(config);
    make({});
  }
  static CameraConfig rolling() {
    CameraConfig config = PaintedWall::camera();
    config.colour_readout_ms = config.depth_readout_ms = 1e3 * kReadout_s;
    return config;
  }
};

TEST_F(RollingTrackerTest, TheFirstKeyframeWaitsForTheSecondFrameWhichShowsItsVelocity) {
  make_with(rolling());
  const TrackResult first = see({});
  ASSERT_EQ(first.state, TrackState::kTracking);
  EXPECT_FALSE(first.candidate);
  const TrackResult second = see({.left_px = kStep_px});
  ASSERT_EQ(second.state, TrackState::kTracking);
  ASSERT_TRUE(second.candidate);
  const KeyframeCandidate& late = *second.candidate;
  EXPECT_EQ(late.frame->id, FrameId{0});
  EXPECT_EQ(late.pose.reference, kNoKeyframe);
  EXPECT_EQ(late.read_out.times.colour_readout_s, kReadout_s);
  EXPECT_NEAR(late.read_out.body_velocity.x(),
              PaintedWall::metres(kStep_px) / PaintedWall::kFrame_s, 0.05);
  // Where the rows were read early the camera stood further back.
  const double rows_px = kStep_px * kReadout_s / PaintedWall::kFrame_s;
  for (std::size_t i = 0; i < late.features->size(); ++i) {
    const Feature& seen = first.features->points[i];
    const double share = (seen.uv_px.y() + 0.5) / PaintedWall::kHeight_px - 0.5;
    EXPECT_NEAR(late.features->points[i].ideal_px.x() - seen.ideal_px.x(), share * rows_px, 0.2);
  }
  EXPECT_FALSE(see({.left_px = 2 * kStep_px}).candidate) << "it came once";
}

TEST_F(RollingTrackerTest, WithoutASecondViewTheFirstKeyframeComesAsItWasSeen) {
  make_with(rolling());
  const TrackResult first = see({});
  const TrackResult blank = see_nothing();
  EXPECT_EQ(blank.state, TrackState::kLost);
  ASSERT_TRUE(blank.candidate);
  EXPECT_EQ(blank.candidate->frame->id, FrameId{0});
  EXPECT_EQ(blank.candidate->features, first.features);
  EXPECT_EQ(blank.candidate->read_out.body_velocity.norm(), 0);
}

TEST_F(RollingTrackerTest, OfAnUnknownShutterTheReadOutIsAGuessAndFeaturesStay) {
  CameraConfig unknown = PaintedWall::camera();
  unknown.shutter_known = false;
  make_with(unknown);
  const TrackResult first = see({});
  EXPECT_FALSE(first.candidate);
  const TrackResult second = see({.left_px = kStep_px});
  ASSERT_TRUE(second.candidate);
  EXPECT_EQ(second.candidate->features, first.features);
  ASSERT_TRUE(second.guessed_read_out);
  EXPECT_TRUE(second.guessed_read_out->times.is_global());
  EXPECT_NEAR(second.guessed_read_out->body_velocity.x(),
              PaintedWall::metres(kStep_px) / PaintedWall::kFrame_s, 0.05);
}

}  // namespace
}  // namespace ygslam
