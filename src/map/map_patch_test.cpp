#include <gtest/gtest.h>

#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;

SE3 motion(Rng& rng, double size) {
  Vec6 twist;
  for (double& x : twist) x = rng.uniform(-size, size);
  return SE3::exp(twist);
}

/// The whole world moved: p_new = T_new_old * p_old.
MapPatch moved(const Map& map, const SE3& T_new_old, bool name_points) {
  MapPatch patch = map.start_patch();
  for (const auto& [id, keyframe] : map.keyframes())
    patch.poses.push_back(
        {id, keyframe.T_camera_world, keyframe.T_camera_world * T_new_old.inverse()});
  if (name_points)
    map.for_each_landmark([&](const Landmark& l) {
      patch.points.push_back({l.id, l.p_world, T_new_old * l.p_world});
    });
  return patch;
}

/// Everything that can be measured inside the map is as in `before`.
void expect_same_but_moved(const Map& map, const Map& before, const SE3& T_new_old) {
  ASSERT_EQ(map.keyframes().size(), before.keyframes().size());
  for (const auto& [id, keyframe] : map.keyframes()) {
    const SE3 expected = before.resolved_pose(id) * T_new_old.inverse();
    EXPECT_LT((keyframe.T_camera_world * expected.inverse()).log().norm(), 1e-9);
  }
  ASSERT_EQ(map.landmark_count(), before.landmark_count());
  map.for_each_landmark([&](const Landmark& l) {
    const Landmark& was = before.landmark(l.id);
    EXPECT_LT((l.p_world - T_new_old * was.p_world).norm(), 1e-9);
    EXPECT_LT((l.normal_world - T_new_old.R() * was.normal_world).norm(), 1e-9);
    EXPECT_NEAR(l.max_distance_m, was.max_distance_m, 1e-9);
    EXPECT_EQ(l.descriptor, was.descriptor);
  });
}

class Patch : public ::testing::TestWithParam<bool> {
 protected:
  World world_{300, 21};
  Rng rng_{5};
};

TEST_P(Patch, ARigidMotionMovesAllAndChangesNothing) {
  for (int trial = 0; trial < 10; ++trial) {
    Map map = map_test::true_map(world_, 6).map;
    const Map before = map;
    const SE3 T_new_old = motion(rng_, 2.0);
    EXPECT_FALSE(map.apply(moved(map, T_new_old, GetParam())));
    EXPECT_GT(map.version(), before.version());
    expect_same_but_moved(map, before, T_new_old);
  }
}

TEST_P(Patch, WhatCameSinceIsCarriedAlong) {
  for (int trial = 0; trial < 10; ++trial) {
    auto truth = map_test::true_map(world_, 5);
    Map& map = truth.map;
    const SE3 T_new_old = motion(rng_, 1.0);
    const MapPatch patch = moved(map, T_new_old, GetParam());
    // Meanwhile: a keyframe with landmarks of its own, one moved, a landmark moved, one removed,
    // a keyframe removed.
    const auto seen = world_.see(World::pose(5), 50);
    const KeyframeId later = map_test::add_keyframe(map, seen, KeyframeId{4});
    const LandmarkId own = map.add_landmark(Vec3(0.1, 0.2, 2.5), later, 0);
    map.set_pose(KeyframeId{2}, motion(rng_, 0.01) * map.keyframe(KeyframeId{2}).T_camera_world);
    LandmarkId some = kNoLandmark;
    LandmarkId gone = kNoLandmark;
    for (const LandmarkId id : map.keyframe(KeyframeId{0}).landmarks) {
      if (id == kNoLandmark) continue;
      gone = some;
      some = id;
    }
    map.set_position(some, map.landmark(some).p_world + Vec3(0.01, 0, 0));
    map.remove_landmark(gone);
    map.remove_keyframe(KeyframeId{3});
    const Map before = map;
    map.apply(patch);
    EXPECT_FALSE(map.has_landmark(gone));
    EXPECT_TRUE(map.has_landmark(own));
    expect_same_but_moved(map, before, T_new_old);
    const SE3 removed = before.resolved_pose(KeyframeId{3}) * T_new_old.inverse();
    EXPECT_LT((map.resolved_pose(KeyframeId{3}) * removed.inverse()).log().norm(), 1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(PointsNamedOrNot, Patch, ::testing::Bool());

TEST(MapPatch, ABentWorldKeepsEachKeyframesView) {
  World world(300, 22);
  Map map = map_test::true_map(world, 6).map;
  const Map before = map;
  Rng rng(6);
  MapPatch patch = map.start_patch();
  for (const auto& [id, keyframe] : map.keyframes())
    patch.poses.push_back(
        {id, keyframe.T_camera_world, keyframe.T_camera_world * motion(rng, 0.02)});
  EXPECT_TRUE(map.apply(patch));
  // A landmark stays where its first keyframe saw it.
  map.for_each_landmark([&](const Landmark& l) {
    const KeyframeId first = l.observations.front().keyframe;
    const Vec3 was = before.keyframe(first).T_camera_world * before.landmark(l.id).p_world;
    EXPECT_LT((map.keyframe(first).T_camera_world * l.p_world - was).norm(), 1e-9);
  });
}

}  // namespace
}  // namespace ygslam
