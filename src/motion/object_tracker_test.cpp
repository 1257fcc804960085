#include "motion/object_tracker.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"

namespace ygslam {
namespace {

constexpr int kPerson = 0;
constexpr int kPoints = 120;

struct Thing {
  Vec3 centre_world = Vec3::Zero();
  Vec3 velocity_mps = Vec3::Zero();
  bool seen_by_mask = true;
  bool same_points = true;  // false: none continues a point of the frame before
};

/// Frames of things whose points stay the same; the camera stands at the origin and looks along z.
class Scene {
 public:
  std::vector<Thing> things;

  std::vector<ObjectPoint> frame(int k) {
    std::vector<ObjectPoint> points;
    for (std::size_t t = 0; t < things.size(); ++t) {
      const Thing& thing = things[t];
      Rng rng(t + 1);
      for (int i = 0; i < kPoints; ++i) {
        const Vec3 offset(rng.uniform(-0.2, 0.2), rng.uniform(-0.5, 0.5), rng.uniform(-0.05, 0.05));
        ObjectPoint p;
        p.p_world = thing.centre_world + offset + k / 30.0 * thing.velocity_mps;
        p.depth_m = static_cast<float>(p.p_world.z());
        p.uv_px = (500.0 / p.p_world.z() * p.p_world.head<2>()).cast<float>();
        if (k > 0 && thing.same_points) p.previous = static_cast<std::int32_t>(points.size());
        if (thing.seen_by_mask) {
          p.instance = static_cast<std::uint64_t>(k + 1) << 8U | (t + 1);
          p.class_id = kPerson;
        }
        p.moves = thing.velocity_mps.norm() > 0;
        p.stands = !p.moves;
        points.push_back(p);
      }
    }
    return points;
  }
};

Timestamp at(int k) { return {static_cast<std::int64_t>(k) * 33'333'333}; }

TEST(ObjectTracker, AWalkerHasPlaceBoxAndVelocity) {
  Scene scene;
  scene.things = {{{0, 0, 2}, {0.9, 0, -0.3}}};
  ObjectTracker tracker({});
  for (int k = 0; k <= 30; ++k) tracker.step(at(k), scene.frame(k));
  const auto objects = tracker.objects();
  ASSERT_EQ(objects.size(), 1U);
  const TrackedObject& o = objects.front();
  EXPECT_EQ(o.class_id, kPerson);
  EXPECT_EQ(o.age_frames, 30);
  EXPECT_EQ(o.missing_frames, 0);
  EXPECT_EQ(o.points, kPoints);
  EXPECT_FALSE(o.resting);
  EXPECT_LT((o.velocity_world_mps - Vec3(0.9, 0, -0.3)).norm(), 0.01);
  EXPECT_LT((o.centre_world - Vec3(0.9, 0, 1.7)).norm(), 0.15);
  EXPECT_NEAR(o.max_world.y() - o.min_world.y(), 0.9, 0.1);
}

TEST(ObjectTracker, KeepsItsIdentityThroughMissedDetections) {
  Scene scene;
  scene.things = {{{-0.5, 0, 2}, {0.5, 0, 0}}, {{0.8, 0, 3}, {-0.5, 0, 0}}};
  ObjectTracker tracker({});
  for (int k = 0; k < 90; ++k) {
    scene.things[0].seen_by_mask = k < 4 || k % 20 == 0;
    tracker.step(at(k), scene.frame(k));
    if (k < 4) continue;  // not confirmed yet
    ASSERT_EQ(tracker.objects().size(), 2U) << k;
    EXPECT_EQ(tracker.object_at(0)->id, ObjectId{0});
    EXPECT_EQ(tracker.object_at(0)->class_id, kPerson);
    EXPECT_EQ(tracker.object_at(kPoints)->id, ObjectId{1});
  }
}

TEST(ObjectTracker, IsFoundAgainWhereItsMotionPutsIt) {
  Scene scene;
  scene.things = {{{-0.5, 0, 2}, {1.5, 0, 0}}};
  ObjectTracker tracker({});
  int k = 0;
  for (; k < 20; ++k) tracker.step(at(k), scene.frame(k));
  for (; k < 35; ++k) tracker.step(at(k), {});  // 0.75 m in the dark
  EXPECT_EQ(tracker.objects().front().missing_frames, 15);
  scene.things[0].same_points = false;
  tracker.step(at(k), scene.frame(k));
  ASSERT_EQ(tracker.objects().size(), 1U);
  EXPECT_EQ(tracker.objects().front().id, ObjectId{0});
}

TEST(ObjectTracker, ForgetsWhatNothingConfirms) {
  Scene scene;
  scene.things = {{{0, 0, 2}, Vec3::Zero()}};
  ObjectConfig config;
  config.keep_frames = 10;
  ObjectTracker tracker(config);
  int k = 0;
  for (; k < 6; ++k) tracker.step(at(k), scene.frame(k));
  scene.things[0].seen_by_mask = false;
  for (; k < 16; ++k) tracker.step(at(k), scene.frame(k));
  EXPECT_EQ(tracker.objects().size(), 1U);
  tracker.step(at(k), scene.frame(k));
  EXPECT_TRUE(tracker.objects().empty());
  EXPECT_EQ(tracker.object_at(0), nullptr);
}

TEST(ObjectTracker, AGhostOfOneMaskIsNeverShownAndSoonForgotten) {
  Scene scene;
  scene.things = {{{0, 0, 2}, Vec3::Zero()}};
  ObjectTracker tracker({});
  tracker.step(at(0), scene.frame(0));
  EXPECT_NE(tracker.object_at(0), nullptr);
  scene.things[0].seen_by_mask = false;
  for (int k = 1; k <= 3; ++k) {
    tracker.step(at(k), scene.frame(k));
    EXPECT_TRUE(tracker.objects().empty());
  }
  EXPECT_EQ(tracker.object_at(0), nullptr);
}

TEST(ObjectTracker, AMaskThatSeesAPointOutsideFreesIt) {
  Scene scene;
  scene.things = {{{0, 0, 2}, {0.5, 0, 0}}};
  ObjectTracker tracker({});
  tracker.step(at(0), scene.frame(0));
  auto points = scene.frame(1);
  points[3].instance = 0;
  points[3].outside = true;
  points[3].moves = false;
  tracker.step(at(1), points);
  EXPECT_EQ(tracker.object_at(3), nullptr);
  EXPECT_NE(tracker.object_at(4), nullptr);
}

TEST(ObjectTracker, WhatMovesWithoutAMaskBecomesAnObjectAndGetsAClassLater) {
  Scene scene;
  scene.things = {{{-0.6, 0, 2}, {0.5, 0, 0}}, {{0.6, 0, 2}, Vec3::Zero()}};
  scene.things[0].seen_by_mask = scene.things[1].seen_by_mask = false;
  ObjectTracker tracker({});
  int k = 0;
  for (; k < 3; ++k) {
    tracker.step(at(k), scene.frame(k));
    EXPECT_TRUE(tracker.objects().empty());  // not confirmed yet
  }
  for (; k < 10; ++k) tracker.step(at(k), scene.frame(k));
  ASSERT_EQ(tracker.objects().size(), 1U);
  EXPECT_EQ(tracker.objects().front().class_id, kUnknownClass);
  EXPECT_EQ(tracker.object_at(kPoints), nullptr);  // the one that stands
  scene.things[0].seen_by_mask = true;
  tracker.step(at(k), scene.frame(k));
  ASSERT_EQ(tracker.objects().size(), 1U);
  EXPECT_EQ(tracker.objects().front().id, ObjectId{0});
  EXPECT_EQ(tracker.objects().front().class_id, kPerson);
}

TEST(ObjectTracker, RestsAfterAWhileAndMovesAtOnce) {
  Scene scene;
  scene.things = {{{0, 0, 2}, Vec3::Zero()}};
  ObjectConfig config;
  ObjectTracker tracker(config);
  int k = 0;
  for (; k < config.rest_frames - 1; ++k) {
    tracker.step(at(k), scene.frame(k));
    EXPECT_FALSE(tracker.object_at(0)->resting) << k;
  }
  tracker.step(at(k), scene.frame(k));
  EXPECT_TRUE(tracker.object_at(0)->resting);
  auto points = scene.frame(++k);
  for (int i = 0; i < kPoints / 4; ++i) points[i].moves = true, points[i].stands = false;
  tracker.step(at(k), points);
  EXPECT_FALSE(tracker.object_at(0)->resting);
}

TEST(ObjectTracker, TakesAnyPoints) {
  Rng rng(5);
  ObjectTracker tracker({});
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int k = 0; k < 50; ++k) {
    std::vector<ObjectPoint> points(static_cast<std::size_t>(rng.uniform(0, 60)));
    for (auto& p : points) {
      p.uv_px = {static_cast<float>(rng.uniform(-1e4, 1e4)), rng.uniform() < 0.1 ? nan : 5.0F};
      p.depth_m = rng.uniform() < 0.2 ? nan : static_cast<float>(rng.uniform(-1, 3));
      p.p_world = rng.uniform() < 0.2 ? Vec3::Constant(nan) : Vec3(rng.uniform(-9, 9), 0, 1);
      p.previous = static_cast<std::int32_t>(rng.uniform(-2, 100));
      p.instance = static_cast<std::uint64_t>(rng.uniform(0, 3));
      p.moves = rng.uniform() < 0.5;
    }
    tracker.step(at(rng.uniform() < 0.1 ? 0 : k), points);
    for (const auto& o : tracker.objects()) {
      EXPECT_TRUE(o.centre_world.allFinite());
      EXPECT_TRUE(o.velocity_world_mps.allFinite());
    }
    EXPECT_LE(tracker.objects().size(), 100U);
  }
}

}  // namespace
}  // namespace ygslam
