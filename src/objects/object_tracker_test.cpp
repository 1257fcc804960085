#include "objects/object_tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "core/rng.hpp"

namespace ygslam {
namespace {

constexpr int kPerson = 0;
constexpr double kRate_hz = 30;

Camera small_camera() {
  CameraConfig config;
  config.fx = config.fy = 250;
  config.cx = 160;
  config.cy = 120;
  config.width = 320;
  config.height = 240;
  return Camera(config);
}

/// An upright board before a wall, with points on it that stay the same.
struct Thing {
  Vec3 centre = {0, 0, 2};  // in frame 0
  Vec3 velocity_mps = Vec3::Zero();
  Rgb8 colour{200, 30, 30};
  double width_m = 0.4, height_m = 1.2;
  bool in_mask = true;
  float score = 0.9F;
  int points = 60;
  bool same_points = true;  // false: none continues a point of the frame before
};

/// Frames of things before a wall; the camera stands at the origin and looks along z. Masks are
/// exact and come late.
class Scene {
 public:
  static constexpr double kWall_m = 6;
  std::vector<Thing> things;
  int mask_delay = 2;

  ObjectInput frame(int k) {
    RgbdFrame image;
    image.colour = ColourImage(camera_.width(), camera_.height(), {90, 90, 90});
    image.depth_m = DepthImage(camera_.width(), camera_.height(), static_cast<float>(kWall_m));
    Segmentation masks;
    masks.frame = FrameId(static_cast<std::uint32_t>(k));
    masks.ids = GreyImage(camera_.width(), camera_.height());
    for (const Thing& thing : things) paint(thing, k, image, masks);
    waiting_.push_back(std::make_shared<const Segmentation>(masks));
    ObjectInput input;
    input.frame = masks.frame;
    input.stamp = {static_cast<std::int64_t>(k * 1e9 / kRate_hz)};
    input.thumbnail = make_thumbnail(image);
    input.points = points(k, image.depth_m);
    while (std::ssize(waiting_) > mask_delay) {
      input.masks.push_back(waiting_.front());
      waiting_.pop_front();
    }
    return input;
  }

  [[nodiscard]] PixelBox box_of(const Thing& thing, int k) const {
    const Vec3 c = at(thing, k), half(thing.width_m / 2, thing.height_m / 2, 0);
    const Vec2 low = camera_.project(c - half), high = camera_.project(c + half);
    return {static_cast<float>(low.x()), static_cast<float>(low.y()), static_cast<float>(high.x()),
            static_cast<float>(high.y())};
  }
  [[nodiscard]] const Camera& camera() const { return camera_; }

 private:
  static Vec3 at(const Thing& thing, int k) {
    return thing.centre + k / kRate_hz * thing.velocity_mps;
  }

  void paint(const Thing& thing, int k, RgbdFrame& image, Segmentation& masks) const {
    const PixelBox box = box_of(thing, k);
    const auto depth_m = static_cast<float>(at(thing, k).z());
    if (thing.in_mask)
      masks.instances.push_back({kPerson, thing.score, box.x0, box.y0, box.x1, box.y1});
    const auto id = static_cast<std::uint8_t>(thing.in_mask ? masks.instances.size() : 0);
    for (int v = 0; v < camera_.height(); ++v) {
      for (int u = 0; u < camera_.width(); ++u) {
        const auto x = static_cast<float>(u), y = static_cast<float>(v);
        if (x < box.x0 || x >= box.x1 || y < box.y0 || y >= box.y1) continue;
        if (image.depth_m.at(u, v) < depth_m) continue;
        image.depth_m.at(u, v) = depth_m;
        image.colour.at(u, v) = thing.colour;
        masks.ids.at(u, v) = id;
      }
    }
  }

  /// Those that nothing hides.
  std::vector<ObjectPoint> points(int k, const DepthImage& depth_m) {
    std::vector<ObjectPoint> result;
    std::map<std::pair<std::size_t, int>, std::int32_t> index;
    for (std::size_t t = 0; t < things.size(); ++t) {
      const Thing& thing = things[t];
      Rng rng(t + 1);
      for (int i = 0; i < thing.points; ++i) {
        const Vec3 offset(rng.uniform(-0.48, 0.48) * thing.width_m,
                          rng.uniform(-0.48, 0.48) * thing.height_m, 0);
        ObjectPoint p;
        p.p_odom = at(thing, k) + offset;
        p.depth_m = static_cast<float>(p.p_odom.z());
        p.uv_px = camera_.project(p.p_odom).cast<float>();
        const int u = static_cast<int>(p.uv_px.x()), v = static_cast<int>(p.uv_px.y());
        if (!depth_m.contains(u, v) || depth_m.at(u, v) < p.depth_m - 0.01F) continue;
        const auto before = before_.find({t, i});
        if (before != before_.end() && thing.same_points) p.previous = before->second;
        p.moves = thing.velocity_mps.norm() > 0;
        p.stands = !p.moves;
        index[{t, i}] = static_cast<std::int32_t>(result.size());
        result.push_back(p);
      }
    }
    before_ = std::move(index);
    return result;
  }

  Camera camera_ = small_camera();
  std::deque<SegmentationPtr> waiting_;
  std::map<std::pair<std::size_t, int>, std::int32_t> before_;
};

/// Steps over frames [from, to).
std::vector<TrackedObject> run(ObjectTracker& tracker, Scene& scene, int from, int to) {
  std::vector<TrackedObject> objects;
  for (int k = from; k < to; ++k) objects = tracker.step(scene.frame(k));
  return objects;
}

std::vector<TrackedObject> seen(std::vector<TrackedObject> objects) {
  std::erase_if(objects, [](const TrackedObject& o) { return o.box_px.empty(); });
  return objects;
}

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
      if (k < delay + 2) continue;
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
    const auto back = seen(run(tracker, scene, 75, 85));
    ASSERT_EQ(back.size(), 1U);
    EXPECT_EQ(back[0].id == ObjectId{0}, same_clothes);
  }
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

TEST(ObjectTracker, AGhostOfOneMaskIsNeverShown) {
  Scene scene;
  scene.things = {{}};
  ObjectTracker tracker({}, scene.camera());
  (void)tracker.step(scene.frame(0));
  scene.things[0].in_mask = false;
  for (int k = 1; k < 60; ++k) EXPECT_TRUE(tracker.step(scene.frame(k)).empty()) << k;
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
    const Vec3 off(rng.normal(0, 0.01), 0, rng.normal(0, 0.02));
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
    }
  }
}

}  // namespace
}  // namespace ygslam
