#include "tracking/tracker.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"

namespace ygslam {
namespace {

/// Its shutter is known: else the first keyframe waits for the second frame.
Camera small_camera() {
  CameraConfig config = geometry_test::test_camera(260, 320, 240).config();
  config.shutter_known = true;
  return Camera(config);
}

/// A wall of blocks of random brightness, 2 m away; depth on a share of its area.
FramePtr wall(std::uint32_t id, double depth_share, bool textured = true) {
  Rng rng(7);
  auto frame = std::make_shared<RgbdFrame>();
  frame->id = FrameId{id};
  frame->stamp = {static_cast<std::int64_t>(id) * 50'000'000};
  frame->grey = GreyImage(320, 240, 120);
  frame->colour = ColourImage(320, 240);
  frame->depth_m = DepthImage(320, 240);
  if (textured) {
    for (int by = 0; by < 240; by += 12) {
      for (int bx = 0; bx < 320; bx += 12) {
        const auto grey = static_cast<std::uint8_t>(rng.below(256));
        for (int v = by; v < std::min(240, by + 12); ++v)
          for (int u = bx; u < std::min(320, bx + 12); ++u) frame->grey.at(u, v) = grey;
      }
    }
  }
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < static_cast<int>(320 * depth_share); ++u) frame->depth_m.at(u, v) = 2.0F;
  return frame;
}

class TrackerStart : public ::testing::Test {
 protected:
  TrackResult step(const FramePtr& frame) {
    return tracker_.step(frame, std::make_shared<LocalView>(), {}, false);
  }
  static DynamicConfig off() {
    DynamicConfig config;
    config.mode = DynamicMode::kOff;
    return config;
  }
  Camera camera_ = small_camera();
  Tracker tracker_{TrackerConfig{}, OrbConfig{}, off(), camera_, 0};
};

TEST_F(TrackerStart, WaitsForAFrameWithTextureAndDepth) {
  const TrackResult blank = step(wall(0, 1.0, false));
  EXPECT_EQ(blank.state, TrackState::kWaiting);
  EXPECT_FALSE(blank.candidate);
  const TrackResult flat = step(wall(1, 0.0));
  EXPECT_EQ(flat.state, TrackState::kWaiting) << "no depth";
  const TrackResult little = step(wall(2, 0.03));
  EXPECT_EQ(little.state, TrackState::kWaiting) << "too little depth";
  const TrackResult start = step(wall(3, 1.0));
  ASSERT_EQ(start.state, TrackState::kTracking);
  EXPECT_GE(start.inliers, TrackerConfig{}.min_start_points);
  ASSERT_TRUE(start.candidate);
  EXPECT_EQ(start.candidate->pose.reference, kNoKeyframe);
  EXPECT_LT(start.T_world_camera.log().norm(), 1e-12) << "the first camera is the world";
}

TEST_F(TrackerStart, StandsStillBeforeTheFirstViewAndIsLostWithoutAnImage) {
  ASSERT_EQ(step(wall(0, 1.0)).state, TrackState::kTracking);
  const TrackResult same = step(wall(1, 1.0));
  ASSERT_EQ(same.state, TrackState::kTracking);
  EXPECT_LT(same.T_world_camera.log().norm(), 1e-3);
  const TrackResult blank = step(wall(2, 1.0, false));
  EXPECT_EQ(blank.state, TrackState::kLost);
  EXPECT_FALSE(blank.candidate);
}

}  // namespace
}  // namespace ygslam
