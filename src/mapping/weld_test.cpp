#include <gtest/gtest.h>

#include "map/map_test_world.hpp"
#include "mapping/mapper.hpp"

namespace ygslam {
namespace {

using map_test::World;

/// Keyframes that came to the same place twice: the second half knows nothing of the first. Some
/// points have no landmark.
Map seen_twice(World& world, int keyframes, double without) {
  Map map({map_test::kLevels, map_test::kScale});
  std::vector<LandmarkId> landmark;
  for (int i = 0; i < 2 * keyframes; ++i) {
    if (i % keyframes == 0) landmark.assign(world.points().size(), kNoLandmark);
    const auto seen = world.see(World::pose(i % keyframes), static_cast<std::uint32_t>(10 * i),
                                {.noise_px = 0.2});
    const KeyframeId id = map_test::add_keyframe(map, seen, i ? KeyframeId(i - 1) : kNoKeyframe);
    for (std::uint32_t k = 0; k < seen.point.size(); ++k) {
      const auto point = static_cast<std::size_t>(seen.point[k]);
      if (landmark[point] != kNoLandmark) {
        map.add_observation(landmark[point], id, k);
        map.refresh(landmark[point]);
      } else if (world.rng().uniform() >= without) {
        landmark[point] = map.add_landmark(world.points()[point].p_world, id, k);
        map.count_seen(landmark[point], 1 + static_cast<int>(point % 5), 1);
      }
    }
  }
  return map;
}

TEST(Weld, WhatItsLogUndoesIsAsBefore) {
  for (const std::uint64_t seed : {31, 32, 33}) {
    World world(400, seed);
    Map map = seen_twice(world, 4, 0.3);
    const Map before = map;
    FusionLog log;
    for (const KeyframeId id : {KeyframeId{7}, KeyframeId{6}, KeyframeId{5}})
      fuse_with(map, world.camera(), id, {KeyframeId{0}, KeyframeId{1}, KeyframeId{2}}, {}, &log);
    ASSERT_GT(log.fusions.size(), 50U);
    ASSERT_GT(log.added.size(), 10U);
    ASSERT_GT(map.keyframe(KeyframeId{7}).covisible.count(KeyframeId{0}), 0U);

    MapPatch undo = map.start_patch();
    for (auto fusion = log.fusions.rbegin(); fusion != log.fusions.rend(); ++fusion)
      undo.splits.push_back(fusion->undo);
    undo.dropped = log.added;
    map.apply(undo);

    ASSERT_EQ(map.landmark_count(), before.landmark_count());
    before.for_each_landmark([&](const Landmark& was) {
      ASSERT_TRUE(map.has_landmark(was.id));
      const Landmark& is = map.landmark(was.id);
      EXPECT_EQ(map.current_id(was.id), was.id);
      EXPECT_EQ(is.p_world, was.p_world);
      EXPECT_EQ(is.descriptor, was.descriptor);
      EXPECT_EQ(is.visible, was.visible);
      EXPECT_EQ(is.found, was.found);
      EXPECT_EQ(is.first_keyframe, was.first_keyframe);
    });
    for (const auto& [id, was] : before.keyframes()) {
      EXPECT_EQ(map.keyframe(id).landmarks, was.landmarks) << index(id);
      EXPECT_EQ(map.keyframe(id).covisible, was.covisible) << index(id);
    }
  }
}

}  // namespace
}  // namespace ygslam
