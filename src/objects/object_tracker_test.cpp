#include "objects/object_tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "objects/testing/board_scene.hpp"

namespace ygslam {
namespace {

using testing::kPerson;
using testing::run;
using testing::Scene;
using testing::seen;
using testing::small_camera;
using testing::Thing;

TEST(ObjectTracker, AWalkerHasPlaceBoxAndVelocity) {
  Scene scene;
  scene.things = {{.centre = {-0.6, 0, 2}, .velocity_mps = {0.9, 0, -0.3}}};
  ObjectTracker tracker({}, scene.camera());
  const auto objects = run(tracker, scene, 0, 31);
  ASSERT_EQ(objects.size(), 1U);
  const TrackedObject& o = objects.front();
  EXPECT_EQ(o.id, ObjectId{0});
  EXPECT_EQ(o.class_id, kPerson);
  EXPECT_FALSE(o.resting);
  EXPECT_EQ(o.points, 60);
  EXPECT_LT((o.velocity_world_mps - Vec3(0.9, 0, -0.3)).norm(), 0.01);
  EXPECT_LT((o.centre_world - Vec3(0.3, 0, 1.7)).norm(), 0.05);
  EXPECT_NEAR(o.max_world.y() - o.min_world.y(), 0.9 * 1.2, 0.1);
}

TEST(ObjectTracker, ShowsObjectsInTheWorld) {
  const SE3 T_world_odom(so3_exp(Vec3(0.1, 0.7, -0.2)), Vec3(1, -2, 3));
  std::vector<TrackedObject> shown;
  for (const SE3& T : {SE3(), T_world_odom}) {
    Scene scene;
    scene.things = {{.centre = {-0.6, 0, 2}, .velocity_mps = {0.9, 0, -0.3}}};
    ObjectTracker tracker({}, scene.camera());
    (void)run(tracker, scene, 0, 20);
    ObjectInput input = scene.frame(20);
    input.T_world_odom = T;
    shown.push_back(tracker.step(std::move(input)).at(0));
  }
  EXPECT_LT((shown[1].centre_world - T_world_odom * shown[0].centre_world).norm(), 1e-9);
  EXPECT_LT((shown[1].velocity_world_mps - T_world_odom.R() * shown[0].velocity_world_mps).norm(),
            1e-9);
  for (const Vec3& corner : {shown[0].min_world, shown[0].max_world}) {  // the box holds the box
    const Vec3 p_world = T_world_odom * corner;
    EXPECT_TRUE((p_world.array() >= shown[1].min_world.array() - 1e-9).all());
    EXPECT_TRUE((p_world.array() <= shown[1].max_world.array() + 1e-9).all());
  }
}

TEST(ObjectTracker, TheBoxOfALateMaskIsCarriedToThePresent) {
  for (const int delay : {0, 2, 8}) {
    Scene scene;
    scene.mask_delay = delay;
    scene.things = {{.centre = {-0.8, 0, 2.5}, .velocity_mps = {1.2, 0, -0.4}}};
    ObjectTracker tracker({}, scene.camera());
    for (int k = 0; k < 40; ++k) {
      const auto objects = tracker.step(scene.frame(k));
      if (k < delay + 4) continue;
      ASSERT_EQ(objects.size(), 1U) << k;
      EXPECT_GT(iou(objects[0].box_px, scene.box_of(scene.things[0], k)), 0.9) << delay << " " << k;
    }
  }
}

TEST(ObjectTracker, TwoWhoCrossKeepTheirNumbersWithAndWithoutPoints) {
  for (const int points : {60, 0}) {
    Scene scene;
    scene.things = {{.centre = {-0.8, 0, 2}, .velocity_mps = {1, 0, 0}, .points = points},
                    {.centre = {1.0, 0, 3},
                     .velocity_mps = {-1, 0, 0},
                     .colour = {20, 20, 220},
                     .points = points}};
    ObjectTracker tracker({}, scene.camera());
    const auto before = run(tracker, scene, 0, 10);
    ASSERT_EQ(before.size(), 2U);
    const auto after = seen(run(tracker, scene, 10, 50));
    ASSERT_EQ(after.size(), 2U);
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(after[i].id, before[i].id);
      EXPECT_NEAR(after[i].centre_world.z(), before[i].centre_world.z(), 0.1);
    }
  }
}

TEST(ObjectTracker, TwoWhomTheNetworkTakesForOneStayTwo) {
  for (const double apart_m : {0.0, 0.5}) {  // side by side; one half behind the other
    Scene scene;
    scene.things = {
        {.centre = {-0.7, 0, 2}, .velocity_mps = {0.3, 0, 0}},
        {.centre = {-0.2, 0, 2 + apart_m}, .velocity_mps = {0.3, 0, 0}, .colour = {20, 20, 220}}};
    ObjectTracker tracker({}, scene.camera());
    const auto before = run(tracker, scene, 0, 15);
    ASSERT_EQ(before.size(), 2U);
    scene.is_one_instance = true;
    const auto objects = run(tracker, scene, 15, 75);
    ASSERT_EQ(objects.size(), 2U) << apart_m;
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(objects[i].missing_frames, 0);
      const Vec3 there = before[i].centre_world + 2 * scene.things[i].velocity_mps;
      EXPECT_LT((objects[i].centre_world - there).norm(), 0.1) << apart_m << " " << i;
    }
  }
}

TEST(ObjectTracker, HeadAndLegsAboutABoxAreOnePerson) {
  Scene scene;
  scene.things = {{.centre = {0, 0, 2}, .height_m = 1.7}};
  ObjectTracker tracker({}, scene.camera());
  ASSERT_EQ(run(tracker, scene, 0, 15).size(), 1U);
  scene.things = {{.centre = {0, -0.7, 2}, .height_m = 0.3},
                  {.centre = {0, 0.55, 2}, .height_m = 0.6}};
  const auto objects = run(tracker, scene, 15, 60);
  ASSERT_EQ(objects.size(), 1U);
  EXPECT_EQ(objects[0].missing_frames, 0);
  EXPECT_GT(objects[0].max_world.y() - objects[0].min_world.y(), 1.2);
}

TEST(ObjectTracker, WhoseHeadAloneIsInTheMaskIsAsLargeAsDepthShows) {
  for (const bool rest_is_there : {true, false}) {
    Scene scene;
    scene.things = {{.centre = {-0.6, 0, 2}, .velocity_mps = {0.4, 0, 0}}};
    ObjectTracker tracker({}, scene.camera());
    ASSERT_EQ(run(tracker, scene, 0, 30).size(), 1U);
    Thing head = scene.things[0];
    head.centre += Vec3(0, -0.45, -0.01);
    head.height_m = 0.3;
    const Thing whole = scene.things[0];
    scene.things[0].in_mask = false;
    if (!rest_is_there) scene.things.clear();
    scene.things.push_back(head);
    const auto objects = run(tracker, scene, 30, 60);
    ASSERT_EQ(objects.size(), 1U);
    EXPECT_EQ(objects[0].id, ObjectId{0});
    EXPECT_EQ(objects[0].missing_frames, 0);
    EXPECT_GT(iou(objects[0].box_px, scene.box_of(rest_is_there ? whole : head, 59)), 0.8);
  }
}

TEST(ObjectTracker, WhoIsPartlyTooNearForDepthIsWhereHeWasGoing) {
  for (const bool near : {true, false}) {
    Scene scene;
    scene.things = {{.centre = {0, 0, near ? 1.4 : 2.6}, .velocity_mps = {0, 0, -0.8}}};
    ObjectTracker tracker({}, scene.camera());
    ASSERT_EQ(run(tracker, scene, 0, 25).size(), 1U);
    scene.shown = 0.4;
    const auto objects = run(tracker, scene, 25, 36);
    ASSERT_EQ(objects.size(), 1U);
    EXPECT_EQ(objects[0].missing_frames, 0);
    if (near) {
      EXPECT_NEAR(objects[0].body_world.position_m.x(), 0, 0.03);
    } else {
      EXPECT_LT(objects[0].body_world.position_m.x(), -0.06);
    }
  }
}

TEST(ObjectTracker, OneWhoIsAloneIsNotParted) {
  Scene scene;
  scene.things = {{.centre = {-0.5, 0, 2}, .width_m = 0.4},
                  {.centre = {0.5, 0, 2}, .width_m = 0.4}};
  ObjectTracker tracker({}, scene.camera());
  ASSERT_EQ(run(tracker, scene, 0, 15).size(), 2U);
  scene.things.pop_back();
  for (int k = 15; k < 25; ++k) {
    const auto objects = tracker.step(scene.frame(k));
    EXPECT_NEAR(objects.at(0).max_world.x() - objects.at(0).min_world.x(), 0.4, 0.12);
    EXPECT_TRUE(k <= 17 || objects.at(1).missing_frames > 0) << k;
  }
}

TEST(ObjectTracker, KeepsWhoIsHiddenWithGrowingCovariance) {
  Scene scene;
  scene.things = {{.centre = {-0.6, 0, 2}, .velocity_mps = {0.5, 0, 0}}};
  ObjectTracker tracker({}, scene.camera());
  const TrackedObject shown = run(tracker, scene, 0, 40).at(0);
  EXPECT_NEAR(shown.body_world.position_m.z(), 2 + 0.12, 0.03);  // its middle, not its front
  EXPECT_LT((shown.body_world.velocity_mps - Vec3(0.5, 0, 0)).norm(), 0.05);
  scene.things.clear();
  const TrackedObject hidden = run(tracker, scene, 40, 100).at(0);
  EXPECT_GT(hidden.body_world.covariance(0, 0), 20 * shown.body_world.covariance(0, 0));
  EXPECT_GT(hidden.body_world.position_m.x(), shown.body_world.position_m.x() + 0.2);
}

TEST(ObjectTracker, WhatIsHiddenIsNotShownAndIsKnownAgain) {
  Scene scene;
  scene.things = {{.centre = {0, 0, 3}},
                  {.centre = {-1.5, 0, 1.5},
                   .velocity_mps = {1, 0, 0},
                   .colour = {20, 20, 220},
                   .width_m = 0.8,
                   .height_m = 2}};
  ObjectTracker tracker({}, scene.camera());
  ASSERT_EQ(seen(run(tracker, scene, 0, 20)).size(), 2U);
  const auto hidden = run(tracker, scene, 20, 47);
  ASSERT_EQ(hidden.size(), 2U);
  EXPECT_TRUE(hidden[0].box_px.empty());
  EXPECT_FALSE(hidden[1].box_px.empty());
  const auto again = seen(run(tracker, scene, 47, 75));
  ASSERT_EQ(again.size(), 2U);
  EXPECT_EQ(again[0].id, ObjectId{0});
}

TEST(ObjectTracker, WhoComesBackIsKnownByPlaceAndColours) {
  for (const bool same_clothes : {true, false}) {
    Scene scene;
    scene.things = {{}};
    ObjectTracker tracker({}, scene.camera());
    (void)run(tracker, scene, 0, 15);
    const Thing gone = scene.things[0];
    scene.things.clear();
    EXPECT_TRUE(seen(run(tracker, scene, 15, 75)).empty());
    scene.things = {gone};
    scene.things[0].centre.x() += 0.7;
    scene.things[0].same_points = false;
    if (!same_clothes) scene.things[0].colour = {20, 20, 220};
    const auto back = seen(run(tracker, scene, 75, 90));
    ASSERT_EQ(back.size(), 1U);
    EXPECT_EQ(back[0].id == ObjectId{0}, same_clothes);
  }
}

TEST(ObjectTracker, WhoComesBackLegsFirstHasNoOtherNumberMeanwhile) {
  Scene scene;
  scene.things = {{}};
  ObjectTracker tracker({}, scene.camera());
  (void)run(tracker, scene, 0, 15);
  Thing back = scene.things[0];
  scene.things.clear();
  (void)run(tracker, scene, 15, 75);
  const Rgb8 shirt = back.colour, trousers{20, 20, 220};
  back.same_points = false;
  back.centre.x() += 0.7;
  std::vector<ObjectId> shown;
  for (int k = 75; k < 95; ++k) {
    back.colour = k < 80 ? trousers : shirt;
    scene.things = {back};
    for (const TrackedObject& object : seen(tracker.step(scene.frame(k))))
      shown.push_back(object.id);
  }
  EXPECT_GT(shown.size(), 10U);
  EXPECT_EQ(std::count(shown.begin(), shown.end(), ObjectId{0}), std::ssize(shown));
}

TEST(ObjectTracker, WhoIsGoneForLongIsForgotten) {
  ObjectConfig config;
  config.keep_s = 1;
  Scene scene;
  scene.things = {{}};
  ObjectTracker tracker(config, scene.camera());
  EXPECT_EQ(run(tracker, scene, 0, 15).size(), 1U);
  scene.things.clear();
  EXPECT_EQ(run(tracker, scene, 15, 40).size(), 1U);
  EXPECT_TRUE(run(tracker, scene, 40, 50).empty());
}

TEST(ObjectTracker, WhoIsUnseenForASecondFadesUntilSeenAgain) {
  Scene scene;
  scene.things = {{}};
  ObjectTracker tracker({}, scene.camera());
  EXPECT_FALSE(run(tracker, scene, 0, 15).at(0).faded);
  scene.things.clear();
  EXPECT_FALSE(run(tracker, scene, 15, 40).at(0).faded);
  EXPECT_TRUE(run(tracker, scene, 40, 50).at(0).faded);
  scene.things = {{}};
  const auto back = run(tracker, scene, 50, 65);
  ASSERT_EQ(back.size(), 1U);
  EXPECT_EQ(back[0].id, ObjectId{0});
  EXPECT_FALSE(back[0].faded);
}

TEST(ObjectTracker, RestsAfterAWhileAndMovesAtOnce) {
  Scene scene;
  scene.things = {{}};
  ObjectTracker tracker({}, scene.camera());
  EXPECT_FALSE(run(tracker, scene, 0, 8)[0].resting);
  EXPECT_TRUE(run(tracker, scene, 8, 40)[0].resting);
  EXPECT_TRUE(tracker.resting_points().at(0) != 0);
  ObjectInput input = scene.frame(40);
  for (int i = 0; i < 15; ++i) input.points[i].moves = true, input.points[i].stands = false;
  EXPECT_FALSE(tracker.step(std::move(input))[0].resting);
}

TEST(ObjectTracker, GoesOnAfterPointsWereLost) {
  Scene scene;
  scene.things = {{}};
  ObjectTracker tracker({}, scene.camera());
  (void)run(tracker, scene, 0, 10);
  tracker.lose_points();
  const auto objects = seen(run(tracker, scene, 20, 30));
  ASSERT_EQ(objects.size(), 1U);
  EXPECT_EQ(objects[0].id, ObjectId{0});
}

TEST(ObjectTracker, TakesAnyInput) {
  Rng rng(5);
  const Camera camera = small_camera();
  ObjectTracker tracker({}, camera);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int k = 0; k < 120; ++k) {
    ObjectInput input;
    input.frame = FrameId(static_cast<std::uint32_t>(k));
    input.stamp = {static_cast<std::int64_t>((rng.uniform() < 0.1 ? 0 : k) * 3e7)};
    RgbdFrame image;
    image.colour = ColourImage(320, 240);
    image.depth_m = DepthImage(320, 240, rng.uniform() < 0.3 ? nan : 2.0F);
    input.thumbnail = make_thumbnail(image);
    input.points.resize(static_cast<std::size_t>(rng.uniform(0, 60)));
    for (ObjectPoint& p : input.points) {
      p.uv_px = {static_cast<float>(rng.uniform(-1e4, 1e4)), rng.uniform() < 0.1 ? nan : 5.0F};
      p.depth_m = rng.uniform() < 0.2 ? nan : static_cast<float>(rng.uniform(-1, 3));
      p.p_odom = rng.uniform() < 0.2 ? Vec3::Constant(nan) : Vec3(rng.uniform(-9, 9), 0, 1);
      p.previous = static_cast<std::int32_t>(rng.uniform(-2, 100));
      p.moves = rng.uniform() < 0.5;
    }
    Segmentation masks;
    masks.frame = FrameId(static_cast<std::uint32_t>(rng.uniform(0, 130)));
    masks.instances = {{kPerson, 0.9F, 10, 10, 200, 200},
                       {7, 0.9F, 0, 0, 9, 9},
                       {kPerson, nan, 0, 0, nan, 50},
                       {kPerson, 0.8F, -5, nan, 1e9F, 60}};
    masks.ids = rng.uniform() < 0.2 ? GreyImage(40, 30, 1) : GreyImage(320, 240);
    for (auto& id : masks.ids)
      if (rng.uniform() < 0.1) id = static_cast<std::uint8_t>(rng.uniform(0, 256));
    input.masks = {nullptr, std::make_shared<const Segmentation>(masks)};
    for (const TrackedObject& o : tracker.step(std::move(input))) {
      EXPECT_TRUE(o.centre_world.allFinite());
      EXPECT_TRUE(o.velocity_world_mps.allFinite());
      EXPECT_TRUE(o.body_world.position_m.allFinite());
      EXPECT_TRUE(o.body_world.covariance.allFinite());
    }
  }
}

}  // namespace
}  // namespace ygslam
