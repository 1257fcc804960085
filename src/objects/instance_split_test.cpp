// Instances that are parted and put together by who was there a moment ago.
#include "objects/instance_split.hpp"

#include <gtest/gtest.h>

#include "objects/testing/board_scene.hpp"

namespace ygslam {
namespace {

using testing::run;
using testing::Scene;
using testing::seen;
using testing::small_camera;

/// Two tracks at 2 m of which a mask shows one instance: a body and something narrow beside it.
SplitInstances split_body_and_sliver(float score) {
  static const Camera camera = small_camera();
  GreyImage ids(320, 240);
  RgbdFrame image;
  image.colour = ColourImage(320, 240);
  image.depth_m = DepthImage(320, 240, 2.0F);
  for (int v = 40; v < 220; ++v)
    for (int u = 80; u < 140; ++u) ids.at(u, v) = 1;
  for (int v = 100; v < 160; ++v)
    for (int u = 160; u < 184; ++u) ids.at(u, v) = 1;
  ObjectFrame frame;
  frame.in.thumbnail = make_thumbnail(image);
  Tracks tracks;
  for (const auto& [key, u] : {std::pair(0, 110), std::pair(1, 172)}) {
    tracks[key].id = ObjectId{static_cast<std::uint32_t>(key)};
    tracks[key].class_id = kPersonClass;
    frame.place[key] = {{80, 40, 184, 220}, camera.unproject(Vec2(u, 130), 2)};
  }
  InstanceView both;
  both.score = score;
  both.ids = {1};
  both.box = {80, 40, 184, 220};
  return split_merged_instances({both}, ids, frame, tracks, camera);
}

TEST(InstanceSplit, APartIsAsSureAsItShowsOfABody) {
  const auto parts = split_body_and_sliver(0.9F).instances;
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_FLOAT_EQ(parts[0].score, 0.9F);
  EXPECT_LT(parts[1].score, 0.6F);  // about 24 x 60 pixels of 8 mm: 0.09 m2
  EXPECT_GT(parts[1].score, 0.3F);
}

TEST(InstanceSplit, WhoIsSeenOnEitherSideOfWhoPassesIsOnePerson) {
  Scene scene;
  scene.things = {{.centre = {0, 0, 3}, .width_m = 0.9}};
  ObjectTracker tracker({}, scene.camera());
  ASSERT_EQ(run(tracker, scene, 0, 30).size(), 1U);
  scene.things = {{.centre = {-0.3, 0, 3}, .width_m = 0.3},
                  {.centre = {0.3, 0, 3}, .width_m = 0.3},
                  {.centre = {0, 0, 1.5}, .colour = {20, 20, 220}, .width_m = 0.15}};
  const auto objects = seen(run(tracker, scene, 30, 60));
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_EQ(objects[0].id, ObjectId{0});
  EXPECT_GT(objects[0].max_world.x() - objects[0].min_world.x(), 0.7);
}

TEST(InstanceSplit, TwoSideBySideStayTwo) {
  Scene scene;
  scene.things = {{.centre = {-0.25, 0, 2}}, {.centre = {0.25, 0, 2}, .colour = {20, 20, 220}}};
  ObjectTracker tracker({}, scene.camera());
  EXPECT_EQ(seen(run(tracker, scene, 0, 60)).size(), 2U);
}

TEST(InstanceSplit, WhoComesBeforeSomebodyIsNotHe) {
  Scene scene;
  scene.things = {{.centre = {0.2, 0, 3.2}}};
  ObjectTracker tracker({}, scene.camera());
  ASSERT_EQ(run(tracker, scene, 0, 20).size(), 1U);
  scene.is_one_instance = true;  // the network takes both for one, and they wear alike
  scene.things.push_back({.centre = {-1.6, 0, 1.6}, .velocity_mps = {0.6, 0, 0}});
  for (int k = 20; k < 60; ++k) {
    const auto objects = tracker.step(scene.frame(k));
    EXPECT_EQ(objects.at(0).id, ObjectId{0});
    EXPECT_NEAR(objects.at(0).centre_world.z(), 3.2, 0.1) << k;
    if (k < 40) continue;
    ASSERT_EQ(objects.size(), 2U) << k;
    EXPECT_NEAR(objects[1].centre_world.z(), 1.6, 0.1) << k;
    EXPECT_EQ(objects[1].missing_frames, 0) << k;
  }
}

TEST(InstanceSplit, WhatIsFarBehindSomebodyIsNobody) {
  Scene scene;
  scene.things = {{.centre = {0.2, 0, 2}}};
  ObjectTracker tracker({}, scene.camera());
  ASSERT_EQ(run(tracker, scene, 0, 20).size(), 1U);
  scene.is_one_instance = true;  // a part of the furniture is in his mask
  scene.things.push_back({.centre = {-0.3, 0, 3.5}, .colour = {20, 20, 220}});
  EXPECT_EQ(run(tracker, scene, 20, 60).size(), 1U);
}

TEST(InstanceSplit, WhoIsHalfHiddenIsStillWhereHeStands) {
  Scene scene;
  scene.things = {{.centre = {0, 0, 3}, .width_m = 0.6},
                  {.centre = {-0.9, 0, 1.5},
                   .velocity_mps = {0.5, 0, 0},
                   .colour = {20, 20, 220},
                   .width_m = 0.3,
                   .height_m = 2}};
  ObjectTracker tracker({}, scene.camera());
  (void)run(tracker, scene, 0, 30);
  for (int k = 30; k < 44; ++k) {  // from nothing to two thirds of him hidden
    const auto objects = tracker.step(scene.frame(k));
    ASSERT_EQ(objects.size(), 2U) << k;
    const TrackedObject& behind = objects[objects[0].centre_world.z() > 2 ? 0 : 1];
    EXPECT_LT(std::abs(behind.centre_world.x()), 0.06) << k;
  }
}

}  // namespace
}  // namespace ygslam
