#include "tracking/localization.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

using Arrival = Localization::Arrival;

constexpr double kMaxSpeedMps = 1;

SE3 camera_at(double x_m) { return SE3(Mat3::Identity(), Vec3(x_m, 0, 0)).inverse(); }
Timestamp at_s(double s) { return {to_ns(s)}; }

struct Walk {
  LocalView view;  // of the run's first keyframe alone
  Localization localization{kMaxSpeedMps};
  double last_s = 0, last_x_m = 0;
  std::uint32_t frame = 0;

  Walk() {
    view.origin = KeyframeId(0);
    view.others = {{KeyframeId(0), SE3()}};
    localization.trust({kNoKeyframe, SE3()}, at_s(0));
  }
  Arrival go(double s, double x_m, bool was_lost = false) {
    const Arrival arrival = localization.arrive(
        {FrameId(++frame), at_s(s), at_s(last_s), camera_at(x_m), camera_at(last_x_m), was_lost},
        view);
    last_s = s;
    last_x_m = x_m;
    return arrival;
  }
  [[nodiscard]] bool is_provisional() {
    return localization.place(camera_at(last_x_m), view).provisional;
  }
};

TEST(Localization, FollowedFromFrameToFrameItIsSure) {
  Walk walk;
  for (int i = 1; i <= 90; ++i) {
    EXPECT_EQ(walk.go(i / 30.0, i / 90.0), Arrival::kFollowed);
    EXPECT_FALSE(walk.is_provisional());
  }
}

TEST(Localization, WhatWasUnseenForLongOrJumpedIsKnownByItsViewAlone) {
  Walk unseen;
  EXPECT_EQ(unseen.go(0.1, 0), Arrival::kFollowed);
  EXPECT_EQ(unseen.go(2.0, 0), Arrival::kByView);
  EXPECT_TRUE(unseen.is_provisional());
  Walk jumped;
  EXPECT_EQ(jumped.go(0.1, 1.0), Arrival::kByView);
  EXPECT_TRUE(jumped.is_provisional());
}

TEST(Localization, AnImageEveryTwoSecondsIsNoGap) {
  Walk walk;
  for (int i = 1; i <= 20; ++i) EXPECT_EQ(walk.go(2 * i, 0.1 * i), Arrival::kFollowed) << i;
  EXPECT_EQ(walk.go(44, 2.1), Arrival::kByView) << "an image is missing";
}

TEST(Localization, LongerAndLongerGapsAreNoSlowCamera) {
  Walk walk;
  double s = 0;
  for (int i = 0; i < 30; ++i) walk.go(s += 1 / 30.0, 0);
  EXPECT_EQ(walk.go(s += 0.9, 0), Arrival::kFollowed);
  EXPECT_EQ(walk.go(s += 1.3, 0), Arrival::kByView);
  EXPECT_EQ(walk.go(s += 1.9, 0), Arrival::kByView);
}

TEST(Localization, FoundWhereItCannotHaveComeItWasCarried) {
  Walk near;
  EXPECT_EQ(near.go(0.1, 0.4, true), Arrival::kFollowed);
  Walk far;
  EXPECT_EQ(far.go(0.1, 3, true), Arrival::kCarriedOff);
  EXPECT_NEAR(far.localization.reach_m(at_s(0.1)), 0.6, 1e-9);
  EXPECT_TRUE(far.is_provisional());
  Walk in_submap;
  in_submap.view.placed = false;
  EXPECT_EQ(in_submap.go(0.1, 3, true), Arrival::kByView) << "its place is a guess anyway";
}

TEST(Localization, GroundOfASubmapProvesNothingWhenItIsJoined) {
  Walk walk;  // through a map that was loaded: nothing is trusted yet
  walk.localization = Localization(kMaxSpeedMps);
  walk.localization.doubt(FrameId(1));
  const auto sees_ground_of = [&](FrameId frame) {
    KeyframeData data;
    data.frame = frame;
    walk.view.keyframes = {{std::make_shared<const KeyframeData>(data), SE3(), {}, 0}};
  };
  sees_ground_of(FrameId(2));
  walk.view.placed = false;
  for (int i = 1; i <= 50; ++i) walk.go(0.1 * i, 0.02 * i);
  walk.view.placed = true;  // joined
  for (int i = 51; i <= 500; ++i) walk.go(0.1 * i, 0.02 * i);
  EXPECT_TRUE(walk.is_provisional());
  walk.go(51, 12);  // a jump: doubt again
  sees_ground_of(FrameId(30));
  for (int i = 511; i <= 1000; ++i) walk.go(0.1 * i, 12 + 0.02 * (i - 510));
  EXPECT_TRUE(walk.is_provisional());
  sees_ground_of(kNoFrame);
  EXPECT_FALSE(walk.is_provisional());
}

TEST(Localization, WhereAnImuLedOdometryNothingJumpsAndNothingIsInDoubt) {
  Walk walk;
  EXPECT_EQ(walk.go(0.1, 0.1), Arrival::kFollowed);
  walk.localization.coast(camera_at(0.5).inverse());
  const auto arrival = walk.localization.arrive({FrameId(2), at_s(3), at_s(0.1), camera_at(0.8),
                                                 camera_at(0.1), true, camera_at(0.9).inverse()},
                                                walk.view);
  EXPECT_EQ(arrival, Arrival::kFollowed);
  const auto place = walk.localization.place(camera_at(0.8), walk.view);
  EXPECT_NEAR(place.T_odom_camera.t().x(), 0.9, 1e-12);
  EXPECT_NEAR(place.T_world_odom.t().x(), -0.1, 1e-12);
  EXPECT_FALSE(place.provisional);
}

}  // namespace
}  // namespace ygslam
