// The tracker's states, by views that are scripted: frames of a painted wall and a map of one page.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tracking/tracker_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::dynamics_off;
using tracking_test::few_features;
using tracking_test::OnePageMap;
using tracking_test::PaintedWall;
using tracking_test::TrackerTest;

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
