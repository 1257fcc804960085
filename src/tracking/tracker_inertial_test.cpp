// The tracker beside an IMU, by views and predictions that are scripted.
#include <gtest/gtest.h>

#include "tracking/tracker.hpp"
#include "tracking/tracking_test_world.hpp"

namespace ygslam {
namespace {

using tracking_test::dynamics_off;
using tracking_test::few_features;
using tracking_test::OnePageMap;
using tracking_test::PaintedWall;

class InertialTrackerTest : public ::testing::Test {
 protected:
  /// The camera moved along the wall by so many pixels, as an IMU says that trusts itself to std_m.
  static PosePrediction at(double px, double std_m = 0.005) {
    PosePrediction predicted;
    predicted.T_odom_camera = SE3(Mat3::Identity(), Vec3(PaintedWall::metres(px), 0, 0));
    predicted.covariance = Mat6::Identity() * std_m * std_m / 3;
    predicted.unseen_s = PaintedWall::kFrame_s;
    predicted.trusted = true;
    return predicted;
  }
  TrackResult see(const PaintedWall& wall, const PaintedWall::View& view,
                  const std::optional<PosePrediction>& predicted) {
    TrackResult result =
        tracker_.step(tracker_.look(wall.see(number_++, view), predicted), map_.view(), {}, false);
    if (result.candidate) map_.insert(*result.candidate);
    return result;
  }
  TrackResult see_nothing(const std::optional<PosePrediction>& predicted) {
    return see(wall_, {.painted_px = 0, .measured_px = 0}, predicted);
  }
  void start() {
    for (int i = 0; i < 4; ++i) ASSERT_EQ(see(wall_, {}, at(0)).state, TrackState::kTracking);
  }
  static double x_m(const SE3& T) { return T.t().x(); }

  Camera camera_{PaintedWall::camera()};
  PaintedWall wall_{7}, elsewhere_{8};
  OnePageMap map_{camera_};
  Tracker tracker_{TrackerConfig{}, few_features(), dynamics_off(), camera_, 0};
  int number_ = 0;
};

TEST_F(InertialTrackerTest, InTheDarkThePoseIsTheImus) {
  start();
  for (int px = 5; px <= 40; px += 5) {
    const TrackResult dark = see_nothing(at(px, 0.01));
    ASSERT_EQ(dark.state, TrackState::kCoasting);
    EXPECT_NEAR(x_m(dark.T_odom_camera), PaintedWall::metres(px), 1e-9);
    EXPECT_NEAR(x_m(dark.T_world_camera), PaintedWall::metres(px), 0.005);
    EXPECT_TRUE(dark.provisional);
    ASSERT_TRUE(dark.covariance);
    EXPECT_NEAR((*dark.covariance)(0, 0), at(0, 0.01).covariance(0, 0), 1e-12);
    EXPECT_FALSE(dark.candidate);
    EXPECT_TRUE(dark.objects.empty());
  }
  // It comes back where the IMU said, two centimetres off: odom stays, the world is right.
  const TrackResult back = see(wall_, {.left_px = 45}, at(45 - 2.6, 0.02));
  ASSERT_EQ(back.state, TrackState::kTracking);
  EXPECT_FALSE(back.provisional);
  EXPECT_NEAR(x_m(back.T_world_camera), PaintedWall::metres(45), 0.01);
  EXPECT_NEAR(x_m(back.T_odom_camera), PaintedWall::metres(45 - 2.6), 1e-9);
  ASSERT_EQ(back.retracked.size(), 8U) << "each frame in the dark has its share of the two";
  for (std::size_t i = 1; i < back.retracked.size(); ++i)
    EXPECT_EQ(index(back.retracked[i].frame), index(back.retracked[i - 1].frame) + 1);
  // Odometry goes on from there, without a jump.
  const TrackResult next = see(wall_, {.left_px = 47}, at(47 - 2.6));
  EXPECT_EQ(next.state, TrackState::kTracking);
  EXPECT_NEAR(x_m(next.T_odom_camera) - x_m(back.T_odom_camera), PaintedWall::metres(2), 0.005);
}

TEST_F(InertialTrackerTest, ACameraThatHangsTellsNoPose) {
  start();
  for (int px = 5; px <= 40; px += 5) {
    const TrackResult repeated = see(wall_, {}, at(px, 0.01));
    ASSERT_EQ(repeated.state, TrackState::kCoasting) << px;
    EXPECT_NEAR(x_m(repeated.T_odom_camera), PaintedWall::metres(px), 1e-9);
  }
  const TrackResult back = see(wall_, {.left_px = 45}, at(45 - 2.6, 0.02));
  EXPECT_EQ(back.state, TrackState::kTracking);
  EXPECT_NEAR(x_m(back.T_world_camera), PaintedWall::metres(45), 0.01);
}

TEST_F(InertialTrackerTest, WithoutATrustedPredictionItIsLost) {
  start();
  PosePrediction unsure = at(5);
  unsure.trusted = false;
  EXPECT_EQ(see_nothing(unsure).state, TrackState::kLost);
  EXPECT_EQ(see_nothing(std::nullopt).state, TrackState::kLost);
  EXPECT_EQ(see_nothing(at(10, 1.0)).state, TrackState::kLost) << "a metre is no place";
  PosePrediction old = at(10);
  old.unseen_s = 20;
  EXPECT_EQ(see_nothing(old).state, TrackState::kLost);
}

TEST_F(InertialTrackerTest, AnotherPlaceThanThePredictedOneMustProveItself) {
  start();
  ASSERT_EQ(see_nothing(at(0)).state, TrackState::kCoasting);
  // A strip of the wall, enough for a pose, no proof.
  const PaintedWall::View strip{.left_px = 60, .painted_px = 44};
  EXPECT_EQ(see(wall_, strip, at(0)).state, TrackState::kCoasting);
  const TrackResult whole = see(wall_, {.left_px = 60}, at(0));
  EXPECT_EQ(whole.state, TrackState::kTracking) << "the map knows better than the IMU";
  EXPECT_NEAR(x_m(whole.T_world_camera), PaintedWall::metres(60), 0.02);
  EXPECT_TRUE(whole.retracked.empty()) << "nobody knows where it was meanwhile";
}

TEST_F(InertialTrackerTest, WhatIsNewIsMappedWhereTheImuSays) {
  start();
  ASSERT_EQ(see_nothing(at(0)).state, TrackState::kCoasting);
  constexpr double kFar_px = 900;  // beyond all that the map has
  int frames = 0;
  TrackResult result;
  do {
    result = see(elsewhere_, {}, at(kFar_px));
    ASSERT_EQ(result.state, TrackState::kCoasting);
  } while (!result.candidate && ++frames < 30);
  ASSERT_TRUE(result.candidate) << "after half a second";
  EXPECT_GE(frames, 9);
  EXPECT_FALSE(result.candidate->submap_reach_m) << "its place is known";
  const TrackResult next = see(elsewhere_, {.left_px = 2}, at(kFar_px + 2));
  EXPECT_EQ(next.state, TrackState::kTracking);
  EXPECT_FALSE(next.unplaced);
  EXPECT_TRUE(next.provisional) << "until it sees ground that was known";
  EXPECT_NEAR(x_m(next.T_world_camera), PaintedWall::metres(kFar_px + 2), 0.02);
}

TEST_F(InertialTrackerTest, WhoIsTooUnsureOfThePlaceMapsNothingThere) {
  start();
  ASSERT_EQ(see_nothing(at(0)).state, TrackState::kCoasting);
  for (int i = 0; i < 15; ++i) {
    const TrackResult result = see(elsewhere_, {}, at(900, 0.3));
    EXPECT_EQ(result.state, TrackState::kCoasting);
    EXPECT_FALSE(result.candidate);
  }
}

TEST_F(InertialTrackerTest, TheSearchBeginsWhereTheImuSays) {
  start();
  // Farther in one frame than any window about a camera that stands.
  const TrackResult far = see(wall_, {.left_px = 120}, at(120));
  EXPECT_EQ(far.state, TrackState::kTracking);
  EXPECT_NEAR(x_m(far.T_world_camera), PaintedWall::metres(120), 0.01);
  EXPECT_NEAR(x_m(far.T_odom_camera), PaintedWall::metres(120), 0.01);
}

/// The whole view moves past, as a carton that is carried before the lens.
TEST_F(InertialTrackerTest, WhatMovesTheWholeViewTakesNothingAlong) {
  start();
  const auto still = [] {
    PosePrediction predicted = at(0);
    predicted.agreed = true;
    predicted.earlier = {{SE3(), predicted.covariance}};
    return predicted;
  };
  for (const int px : {40, 44, 48}) {
    const TrackResult moved = see(wall_, {.left_px = px}, still());
    EXPECT_EQ(moved.state, TrackState::kCoasting);
    EXPECT_TRUE(moved.overruled);
    EXPECT_FALSE(moved.went_along);
    EXPECT_NEAR(x_m(moved.T_world_camera), 0, 0.005);
    EXPECT_FALSE(moved.candidate);
  }
  const TrackResult again = see(wall_, {}, still());
  EXPECT_EQ(again.state, TrackState::kTracking);
  EXPECT_FALSE(again.overruled);
  EXPECT_NEAR(x_m(again.T_world_camera), 0, 0.01);
}

/// Slowly, so that the newest prediction goes along: the one of half a second ago does not.
TEST_F(InertialTrackerTest, WhatTookTheImuAlongIsToldByThePredictionFromBefore) {
  start();
  PosePrediction misled = at(40);
  misled.agreed = true;
  misled.earlier = {{SE3(), at(0).covariance}};
  const TrackResult moved = see(wall_, {.left_px = 40}, misled);
  EXPECT_EQ(moved.state, TrackState::kCoasting);
  EXPECT_TRUE(moved.went_along);
  EXPECT_NEAR(x_m(moved.T_world_camera), 0, 0.005);
  EXPECT_NEAR(x_m(moved.T_odom_camera), 0, 0.005);
}

}  // namespace
}  // namespace ygslam
