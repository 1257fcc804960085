// A tracker whose views are scripted: frames of a painted wall and a map of one page.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "tracking/tracker.hpp"
#include "tracking/tracking_test_world.hpp"

namespace ygslam::tracking_test {

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

}  // namespace ygslam::tracking_test
