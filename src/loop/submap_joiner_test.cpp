#include "loop/submap_joiner.hpp"

#include <gtest/gtest.h>

#include "loop/loop_test_world.hpp"

namespace ygslam {
namespace {

using loop_test::RingWorld;
using loop_test::Walk;

constexpr KeyframeId kRoot{30};

/// The second submap lies somewhere else than it is; lap two shows places of lap one.
Map two_submaps(RingWorld& ring, const Walk& walk, const SE3& T_guess_world) {
  Map map = ring.walk(walk);
  MapPatch patch = map.start_patch();
  for (const auto& [id, keyframe] : map.keyframes())
    if (map.root_of(id) == kRoot)
      patch.poses.push_back(
          {id, keyframe.T_camera_world, keyframe.T_camera_world * T_guess_world.inverse()});
  map.apply(patch);
  return map;
}

SE3 somewhere_else() {
  Vec6 twist;
  twist << 2, -1, 0.5, 0.3, -0.2, 0.8;
  return SE3::exp(twist);
}

/// The keyframes of the submap come one after the other.
std::optional<SubmapJoin> join(const RingWorld& ring, const Map& map, KeyframeId root,
                               double reach_m = 0) {
  PlaceIndex index;
  index.rebuild(map);
  LoopCloser closer({}, ring.camera());
  SubmapJoiner joiner({});
  joiner.begin(root, reach_m);
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (map.root_of(id) != root) continue;
    const LoopResult result = closer.step(map, index, id);
    if (auto found = joiner.step(map, result.attempts)) return found;
  }
  return std::nullopt;
}

TEST(SubmapJoiner, MovesTheYoungerSubmapToWhereItsViewsOfTheOlderPutIt) {
  RingWorld ring(21);
  Walk walk;
  walk.torn_at = 30;
  walk.drift_m = walk.drift_rad = 0;
  Map map = two_submaps(ring, walk, somewhere_else());
  const auto found = join(ring, map, kRoot);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->root, kRoot);
  EXPECT_LT(found->parent, kRoot);
  EXPECT_GE(found->pairs.size(), 3U);
  map.apply(found->patch);
  map.join(found->root, found->parent);
  for (const auto& [id, keyframe] : map.keyframes()) {
    EXPECT_EQ(map.root_of(id), map.origin());
    const SE3 truth = RingWorld::true_pose(walk, static_cast<int>(index(id)));
    EXPECT_LT((keyframe.position_world() - truth.inverse().t()).norm(), 0.03) << index(id);
  }
}

TEST(SubmapJoiner, AFewViewsFromOnePlaceAreNotEnough) {
  RingWorld ring(22);
  Walk walk;
  walk.torn_at = 30;
  walk.keyframes = 34;  // four of them, within 23 degrees, see what was seen before
  walk.drift_m = walk.drift_rad = 0;
  const Map map = two_submaps(ring, walk, somewhere_else());
  const Vec3 begin = RingWorld::true_pose(walk, 30).inverse().t();
  const double way_m = (map.keyframe(kRoot).position_world() - begin).norm();
  EXPECT_FALSE(join(ring, map, kRoot));
  EXPECT_FALSE(join(ring, map, kRoot, 0.5 * way_m)) << "the camera cannot have come so far";
  EXPECT_TRUE(join(ring, map, kRoot, 1.1 * way_m));
}

TEST(SubmapJoiner, WhatFitsTwoPlacesIsNotJoined) {
  RingWorld ring(23);
  ring.repeat_half_a_turn_away();
  Walk walk;
  walk.torn_at = 48;
  walk.keyframes = 72;
  walk.drift_m = walk.drift_rad = 0;
  const Map map = ring.walk(walk);
  EXPECT_FALSE(join(ring, map, KeyframeId{48}));
}

}  // namespace
}  // namespace ygslam
