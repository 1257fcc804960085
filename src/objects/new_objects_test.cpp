// What becomes an object of the tracker, and what does not.
#include <gtest/gtest.h>

#include <cmath>

#include "objects/testing/board_scene.hpp"

namespace ygslam {
namespace {

using testing::kPerson;
using testing::run;
using testing::Scene;
using testing::seen;

TEST(ObjectTracker, AGhostOfOneMaskIsNeverShown) {
  Scene scene;
  scene.things = {{}};
  ObjectTracker tracker({}, scene.camera());
  (void)tracker.step(scene.frame(0));
  scene.things[0].in_mask = false;
  for (int k = 1; k < 60; ++k) EXPECT_TRUE(tracker.step(scene.frame(k)).empty()) << k;
}

TEST(ObjectTracker, WhatEveryOtherMaskOverlooksIsNoObject) {
  Scene scene;
  scene.things = {{.score = 0.6F}};
  ObjectTracker tracker({}, scene.camera());
  for (int k = 0; k < 40; ++k) {
    scene.things[0].in_mask = k % 2 == 0;
    EXPECT_TRUE(tracker.step(scene.frame(k)).empty()) << k;
  }
}

TEST(ObjectTracker, AGhostThatMasksNoLongerShowIsForgottenButNotAPerson) {
  for (const int shown : {6, 60}) {
    Scene scene;
    scene.things = {{}};
    ObjectTracker tracker({}, scene.camera());
    ASSERT_EQ(run(tracker, scene, 0, shown).size(), 1U);
    scene.things[0].in_mask = false;  // in plain view
    EXPECT_EQ(run(tracker, scene, shown, shown + 25).size(), shown == 6 ? 0U : 1U);
  }
}

TEST(ObjectTracker, WhoIsHiddenIsNotForgottenAsAGhost) {
  Scene scene;
  scene.things = {{.centre = {0, 0, 3}}};
  ObjectTracker tracker({}, scene.camera());
  ASSERT_EQ(run(tracker, scene, 0, 8).size(), 1U);
  scene.things.push_back({.centre = {0, 0, 1.5}, .width_m = 0.8, .height_m = 2, .in_mask = false});
  EXPECT_EQ(run(tracker, scene, 8, 60).at(0).id, ObjectId{0});
}

TEST(ObjectTracker, WhatShowsLittleOfABodyIsNobodyWhoWasLongAway) {
  for (const float score : {0.3F, 0.9F}) {
    Scene scene;
    scene.things = {{}};
    ObjectTracker tracker({}, scene.camera());
    (void)run(tracker, scene, 0, 40);
    const testing::Thing gone = scene.things[0];
    scene.things.clear();
    EXPECT_TRUE(seen(run(tracker, scene, 40, 80)).empty());
    scene.things = {gone};
    scene.things[0].centre.x() += 0.7;
    scene.things[0].same_points = false;
    scene.things[0].score = score;
    EXPECT_EQ(seen(run(tracker, scene, 80, 100)).size(), score < 0.5F ? 0U : 1U) << score;
  }
}

TEST(ObjectTracker, AWeakDetectionContinuesAnObjectButBeginsNone) {
  Scene scene;
  scene.things = {{.score = 0.3F}};
  ObjectTracker tracker({}, scene.camera());
  EXPECT_TRUE(run(tracker, scene, 0, 30).empty());
  scene.things[0].score = 0.9F;
  EXPECT_EQ(run(tracker, scene, 30, 40).size(), 1U);
  scene.things[0].score = 0.3F;
  EXPECT_EQ(seen(run(tracker, scene, 40, 90)).size(), 1U);
}

TEST(ObjectTracker, AHeadFoundOnceMoreIsNoSecondPerson) {
  Scene scene;
  scene.things = {{}, {.centre = {0, -0.45, 1.9}, .width_m = 0.2, .height_m = 0.25, .score = 0.6F}};
  ObjectTracker tracker({}, scene.camera());
  const auto objects = run(tracker, scene, 0, 20);
  ASSERT_EQ(objects.size(), 1U);
  EXPECT_GT(objects[0].box_px.height(), 100);
}

TEST(ObjectTracker, APersonBehindAnotherIsASecondOne) {
  Scene scene;
  scene.things = {{.centre = {0, 0, 2}}, {.centre = {0.25, -0.2, 3.2}, .colour = {20, 20, 220}}};
  ObjectTracker tracker({}, scene.camera());
  EXPECT_EQ(run(tracker, scene, 0, 20).size(), 2U);
}

TEST(ObjectTracker, WhatMovesWithoutAMaskBecomesAnObjectAndGetsAClassLater) {
  Scene scene;
  scene.things = {{.centre = {-0.7, 0, 2}, .velocity_mps = {0.5, 0, 0}, .in_mask = false},
                  {.centre = {0.7, 0, 2}, .in_mask = false}};
  ObjectTracker tracker({}, scene.camera());
  EXPECT_TRUE(run(tracker, scene, 0, 5).empty());  // not confirmed yet
  auto objects = run(tracker, scene, 5, 20);
  ASSERT_EQ(objects.size(), 1U);  // not the one that stands
  EXPECT_EQ(objects[0].class_id, kUnknownClass);
  EXPECT_GT(iou(objects[0].box_px, scene.box_of(scene.things[0], 19)), 0.7);
  scene.things[0].in_mask = true;
  objects = run(tracker, scene, 20, 30);
  ASSERT_EQ(objects.size(), 1U);
  EXPECT_EQ(objects[0].id, ObjectId{0});
  EXPECT_EQ(objects[0].class_id, kPerson);
}

TEST(ObjectTracker, WhatAPersonCarriesIsNoObjectOfItsOwn) {
  Scene scene;
  scene.things = {{.centre = {-0.6, 0, 2}, .velocity_mps = {0.5, 0, 0}},
                  {.centre = {-0.36, 0.1, 1.9},
                   .velocity_mps = {0.5, 0, 0},
                   .width_m = 0.15,
                   .height_m = 0.15,
                   .in_mask = false,
                   .points = 20}};
  ObjectTracker tracker({}, scene.camera());
  EXPECT_EQ(run(tracker, scene, 0, 45).size(), 1U);
}

TEST(ObjectTracker, PointsThatTrembleAreNoObject) {
  Scene scene;
  scene.things = {{.in_mask = false}};
  ObjectTracker tracker({}, scene.camera());
  Rng rng(3);
  for (int k = 0; k < 60; ++k) {
    ObjectInput input = scene.frame(k);
    const double off_z = rng.normal(0, 0.02);
    const Vec3 off(rng.normal(0, 0.01), 0, off_z);
    for (ObjectPoint& p : input.points) p.moves = true, p.p_odom += off;
    EXPECT_TRUE(tracker.step(std::move(input)).empty()) << k;
  }
}

TEST(ObjectTracker, PointsThatSlideAlongAnEdgeAreNoObject) {
  constexpr double kLength_m = 0.8, kStep_m = 0.02;
  Scene scene;
  scene.things = {{.in_mask = false}};
  ObjectTracker tracker({}, scene.camera());
  for (int k = 0; k < 60; ++k) {
    ObjectInput input = scene.frame(k);
    for (std::size_t i = 0; i < input.points.size(); ++i) {
      ObjectPoint& p = input.points[i];
      const double along_m = std::fmod(0.013 * static_cast<double>(i) + kStep_m * k, kLength_m);
      p.p_odom = {0, along_m - kLength_m / 2, 2};
      p.uv_px = scene.camera().project(p.p_odom).cast<float>();
      p.moves = true;
      if (along_m < kStep_m) p.previous = -1;  // vanished at one end, came at the other
    }
    EXPECT_TRUE(tracker.step(std::move(input)).empty()) << k;
  }
}

}  // namespace
}  // namespace ygslam
