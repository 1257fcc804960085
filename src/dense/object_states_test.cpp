// What becomes of objects: they stay, are hidden, are taken away, stand elsewhere.
#include <gtest/gtest.h>

#include <functional>

#include "dense/scene_naming/object_test_world.hpp"

namespace ygslam {
namespace {

using object_test::kChair;
using object_test::kScreen;
using volume_test::Cuboid;
using volume_test::World;

constexpr SemanticClass kPerson = coco_class(0);

/// Two boxes; the chair may be away, elsewhere, or behind somebody.
World room(bool has_chair, const Vec3& chair_moved = Vec3::Zero(), bool is_hidden = false) {
  World world = object_test::two_boxes();
  world.cuboids[0].low += chair_moved;
  world.cuboids[0].high += chair_moved;
  if (!has_chair) world.cuboids.erase(world.cuboids.begin());
  if (is_hidden) {
    world.cuboids.push_back(
        {Vec3(-1.1, -0.4, -0.9), Vec3(0.1, 1.2, -0.7), SceneObjectId{3}, {20, 200, 20}});
  }
  return world;
}

/// Adds seven views of the world, a second apart.
void add_views(const World& world, const Camera& camera, DenseUpdate& update) {
  for (std::uint32_t k = 0; k < 7; ++k) {
    const auto id = static_cast<std::uint32_t>(update.added.size());
    // Back and forth.
    const SE3 T_world_camera = object_test::view_pose(id / 7 % 2 == 0 ? k : 6 - k);
    DenseFrame keyframe = object_test::keyframe_of(
        world, camera, id, T_world_camera, {{kChair, 0.8F}, {kScreen, 0.6F}, {kPerson, 0.9F}},
        Timestamp{1'000'000'000 * std::int64_t{id}});
    keyframe.movers = GreyImage(camera.width(), camera.height());
    for (std::size_t i = 0; i < keyframe.things.size(); ++i) {
      if (keyframe.things.begin()[i] != 3) continue;
      keyframe.things.begin()[i] = 0;
      keyframe.movers.begin()[i] = 255;
    }
    keyframe.detections.pop_back();
    update.added.push_back(std::move(keyframe));
    update.T_world_camera[KeyframeId{id}] = T_world_camera;
  }
}

int vertices_in(const StaticScene& scene, const Cuboid& cuboid) {
  int count = 0;
  for (const SurfacePoint& vertex : scene.mesh.vertices) {
    const Vec3 p = vertex.p_world.cast<double>();
    // But for the floor it stands on.
    const bool inside = (p.array() > cuboid.low.array() - 0.03).all() &&
                        (p.array() < cuboid.high.array() + 0.03).all() &&
                        p.y() < cuboid.high.y() - 0.06;
    count += inside ? 1 : 0;
  }
  return count;
}

struct Outcome {
  StaticScene scene;
  std::uint64_t fingerprint = 0;
};
Outcome at_once(const DenseUpdate& update, const Camera& camera, int threads) {
  DenseMapConfig config = object_test::room_config();
  config.volume.threads = threads;
  DenseMap map(config, camera);
  map.apply(update);
  map.finish();
  return {named_scene(map), map.volume().fingerprint()};
}

/// How far a keyframe is off when so many have come.
using Drift_m = std::function<double(std::size_t keyframe, std::size_t count)>;
double all_drift_m(std::size_t keyframe, std::size_t /*count*/) {
  return 0.004 * static_cast<double>(keyframe % 9);
}

/// Keyframe by keyframe, on poses that drift until they are corrected in the middle and at the end.
Outcome as_it_comes(const DenseUpdate& update, const Camera& camera,
                    const std::function<void(DenseMap&)>& before_finish,
                    const Drift_m& drift_m = all_drift_m) {
  DenseMap map(object_test::room_config(), camera);
  DenseUpdate sofar;
  for (std::size_t i = 0; i < update.added.size(); ++i) {
    sofar.added = {update.added[i]};
    for (std::size_t k = 0; k <= i; ++k) {
      const KeyframeId id = update.added[k].id.keyframe;
      const double off_m = drift_m(k, i);
      sofar.T_world_camera[id] =
          SE3(Mat3::Identity(), Vec3(off_m, 0, off_m)) * update.T_world_camera.at(id);
    }
    map.apply(sofar);
    while (map.step()) {
    }
  }
  map.apply({{}, {}, update.T_world_camera});
  while (map.step()) {
  }
  before_finish(map);
  map.finish();
  return {named_scene(map), map.volume().fingerprint()};
}

/// The live map is the one made at once of the final inputs, for any number of threads.
StaticScene expect_pure(
    const DenseUpdate& update, const Camera& camera,
    const std::function<void(DenseMap&)>& before_finish = [](DenseMap&) {}) {
  const Outcome live = as_it_comes(update, camera, before_finish);
  for (const int threads : {1, 2, 4})
    EXPECT_EQ(live.fingerprint, at_once(update, camera, threads).fingerprint) << threads;
  return live.scene;
}

TEST(ObjectStates, AThingThatWasPutElsewhereKeepsItsNumberAndFreesItsOldPlace) {
  const Camera camera = object_test::room_camera();
  const Vec3 moved(0.2, 0, 0.75);
  DenseUpdate update;
  add_views(room(true), camera, update);
  add_views(room(true, moved), camera, update);
  const StaticScene scene = expect_pure(update, camera, [&](DenseMap& map) {
    EXPECT_LT(vertices_in(named_scene(map), room(true).cuboids[0]), 20) << "free before the end";
  });
  ASSERT_EQ(scene.objects.size(), 2U);
  const SceneObject& chair = scene.objects[0];
  EXPECT_EQ(chair.semantic_class, kChair);
  EXPECT_EQ(chair.state, ObjectState::kSettled);
  EXPECT_EQ(chair.epochs, 2);
  EXPECT_EQ(chair.views, 14);
  constexpr double kBack_m = 0.03;  // of what lies behind its edge
  object_test::expect_box(chair, room(true, moved).cuboids[0],
                          object_test::kBoxTolerance_m + kBack_m);
  ASSERT_EQ(chair.earlier.size(), 1U);
  SceneObject before = chair;
  before.box = chair.earlier[0].box;
  object_test::expect_box(before, room(true).cuboids[0], object_test::kBoxTolerance_m);
  EXPECT_EQ(chair.earlier[0].last_seen.ns, 6'000'000'000);
  EXPECT_LE(chair.earlier[0].found_empty.ns, 9'000'000'000);
  EXPECT_EQ(vertices_in(scene, room(true).cuboids[0]), 0);
  EXPECT_GT(vertices_in(scene, room(true, moved).cuboids[0]), 300);
  EXPECT_EQ(scene.objects[1].state, ObjectState::kStatic);
  EXPECT_EQ(scene.objects[1].epochs, 1);
}

TEST(ObjectStates, AThingThatWasTakenAwayIsAbsentAndNoSurfaceIsLeft) {
  const Camera camera = object_test::room_camera();
  DenseUpdate update;
  add_views(room(true), camera, update);
  add_views(room(false), camera, update);
  const StaticScene scene = expect_pure(update, camera);
  ASSERT_EQ(scene.objects.size(), 2U);
  EXPECT_EQ(scene.objects[0].state, ObjectState::kAbsent);
  ASSERT_TRUE(scene.objects[0].found_empty);
  EXPECT_LE(scene.objects[0].found_empty->ns, 9'000'000'000);
  object_test::expect_box(scene.objects[0], room(true).cuboids[0], object_test::kBoxTolerance_m);
  EXPECT_EQ(vertices_in(scene, room(true).cuboids[0]), 0);
  EXPECT_EQ(scene.objects[1].state, ObjectState::kStatic);
}

TEST(ObjectStates, WhatIsHiddenStaysHoweverLong) {
  const Camera camera = object_test::room_camera();
  DenseUpdate update;
  add_views(room(true), camera, update);
  const int before = vertices_in(at_once(update, camera, 1).scene, room(true).cuboids[0]);
  for (int i = 0; i < 3; ++i) add_views(room(true, Vec3::Zero(), true), camera, update);
  const StaticScene scene = expect_pure(update, camera);
  ASSERT_EQ(scene.objects.size(), 2U) << "and who hides it is none";
  EXPECT_NE(scene.objects[0].state, ObjectState::kAbsent);
  EXPECT_FALSE(scene.objects[0].found_empty);
  EXPECT_GE(vertices_in(scene, room(true).cuboids[0]), 0.9 * before);
}

TEST(ObjectStates, WhatIsOutOfSightIsUnobserved) {
  const Camera camera = object_test::room_camera();
  DenseUpdate update;
  add_views(room(true), camera, update);
  for (std::uint32_t id = 7; id < 15; ++id) {
    const SE3 away = volume_test::look_at(Vec3(0, -0.5, -1), Vec3(0, -0.2, -1.9));
    update.added.push_back(object_test::keyframe_of(room(true), camera, id, away, {{}, {}},
                                                    Timestamp{1'000'000'000 * std::int64_t{id}}));
    update.T_world_camera[KeyframeId{id}] = away;
  }
  const StaticScene scene = expect_pure(update, camera);
  ASSERT_EQ(scene.objects.size(), 2U);
  for (const SceneObject& object : scene.objects) EXPECT_EQ(object.state, ObjectState::kUnobserved);
}

TEST(ObjectStates, WhatMovesAddsNothingWhereItPassesBy) {
  const Camera camera = object_test::room_camera();
  DenseUpdate update;
  add_views(room(true), camera, update);
  for (int i = 1; i <= 3; ++i) {
    add_views(room(true, Vec3(0, 0, 0.12 * i)), camera, update);
    update.added.resize(7 + static_cast<std::size_t>(i));  // one view of each place
    DenseFrame& keyframe = update.added.back();
    for (std::size_t k = 0; k < keyframe.things.size(); ++k)
      if (keyframe.things.begin()[k] == 1 && k % 2 == 0) keyframe.movers.begin()[k] = 255;
  }
  std::erase_if(update.T_world_camera, [](const auto& entry) { return index(entry.first) >= 10; });
  const StaticScene scene = expect_pure(update, camera);
  ASSERT_EQ(scene.objects.size(), 2U);
  EXPECT_EQ(scene.objects[0].state, ObjectState::kMoving);
  EXPECT_EQ(scene.objects[0].views, 7);
  EXPECT_EQ(scene.objects[1].state, ObjectState::kStatic);
}

TEST(ObjectStates, WhatNoMaskTellsOfComesAndGoesTheSameWhereFewPosesAreCorrected) {
  const Camera camera = object_test::room_camera();
  DenseUpdate update;
  add_views(room(true), camera, update);
  add_views(room(false), camera, update);
  add_views(room(true, Vec3(0.15, -0.1, -0.55)), camera, update);  // before its first place
  for (DenseFrame& keyframe : update.added) {
    keyframe.detections.clear();
    for (std::uint8_t& number : keyframe.things) number = 0;
  }
  // Too few for the end to begin anew, too little for a step to put one in at another pose.
  const auto few_drift_m = [](std::size_t keyframe, std::size_t count) {
    return keyframe % 3 == 0 ? 0.002 * static_cast<double>(count % 4) : 0;
  };
  const Outcome live = as_it_comes(
      update, camera, [](DenseMap&) {}, few_drift_m);
  EXPECT_EQ(live.fingerprint, at_once(update, camera, 1).fingerprint);
}

}  // namespace
}  // namespace ygslam
