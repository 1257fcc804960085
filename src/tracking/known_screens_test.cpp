#include "tracking/known_screens.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

constexpr Timestamp kScreenNow{to_ns(100)};
constexpr double kScreenDistance_m = 2;

/// A screen of 0.6 x 0.4 m straight ahead.
KnownScreens::Sighting screen_ahead() {
  KnownScreens::Sighting seen;
  for (const double x : {-0.3, 0.0, 0.3})
    for (const double y : {-0.2, 0.2}) seen.p_camera.emplace_back(x, y, kScreenDistance_m);
  seen.plane = Vec3(0, 0, 1 / kScreenDistance_m);
  return seen;
}

TEST(KnownScreens, WhatLiesOnTheScreenIsShownWhatLiesBesideOrBehindItIsNot) {
  const SE3 T_odom_camera(so3_exp(Vec3(0.1, 0.4, -0.2)), Vec3(1, -2, 0.5));
  KnownScreens screens;
  EXPECT_FALSE(screens.shows(T_odom_camera * Vec3(0, 0, kScreenDistance_m), kScreenDistance_m));
  screens.add(screen_ahead(), T_odom_camera, kScreenNow);
  const auto shows = [&](const Vec3& p) { return screens.shows(T_odom_camera * p, p.z()); };
  EXPECT_TRUE(shows({0.1, 0.1, kScreenDistance_m}));
  EXPECT_TRUE(shows({0.31, 0.21, kScreenDistance_m}));
  EXPECT_FALSE(shows({0.4, 0, kScreenDistance_m}));
  EXPECT_FALSE(shows({0, 0.3, kScreenDistance_m}));
  EXPECT_FALSE(shows({0, 0, kScreenDistance_m + 0.2}));
  EXPECT_FALSE(shows({0, 0, kScreenDistance_m - 0.2}));
}

TEST(KnownScreens, GrowsWithWhatMovesAtItsEdge) {
  KnownScreens screens;
  screens.add(screen_ahead(), SE3(), kScreenNow);
  const Vec3 beside(0.42, 0, kScreenDistance_m);
  const std::vector<Vec3> one{beside};
  screens.renew(one, SE3(), kScreenNow);
  EXPECT_FALSE(screens.shows(beside, kScreenDistance_m)) << "one point is a bad flow";
  const std::vector<Vec3> several(5, beside);
  screens.renew(several, SE3(), kScreenNow);
  EXPECT_TRUE(screens.shows(beside, kScreenDistance_m));
  const std::vector<Vec3> far(5, Vec3(1.5, 0, kScreenDistance_m));
  screens.renew(far, SE3(), kScreenNow);
  EXPECT_FALSE(screens.shows(far.front(), kScreenDistance_m));
}

TEST(KnownScreens, ForgetsAScreenThatHasBeenStillForLong) {
  const auto later = [](double s) { return Timestamp{kScreenNow.ns + to_ns(s)}; };
  KnownScreens screens;
  screens.add(screen_ahead(), SE3(), kScreenNow);
  screens.forget_still(later(15));
  EXPECT_FALSE(screens.empty());
  screens.renew(screen_ahead().p_camera, SE3(), later(15));
  screens.forget_still(later(30));
  EXPECT_FALSE(screens.empty());
  screens.forget_still(later(60));
  EXPECT_TRUE(screens.empty());
}

}  // namespace
}  // namespace ygslam
