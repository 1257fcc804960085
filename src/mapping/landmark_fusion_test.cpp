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

TEST(LandmarkFusion, WhatBothVisitsSeeOfAPointBecomesOne) {
  for (const std::uint64_t seed : {31, 32, 33}) {
    World world(400, seed);
    Map map = seen_twice(world, 4, 0.3);
    const Map before = map;
    int changes = 0;
    for (const KeyframeId id : {KeyframeId{7}, KeyframeId{6}, KeyframeId{5}})
      changes +=
          fuse_with(map, world.camera(), id, {KeyframeId{0}, KeyframeId{1}, KeyframeId{2}}, {});
    std::size_t fused = 0;
    before.for_each_landmark([&](const Landmark& was) {
      const LandmarkId now = map.current_id(was.id);
      ASSERT_TRUE(map.has_landmark(now));
      EXPECT_LT((map.landmark(now).p_world - was.p_world).norm(), 1e-9) << "another point";
      fused += now != was.id ? 1 : 0;
    });
    EXPECT_GT(fused, 50U);
    EXPECT_GT(changes, static_cast<int>(fused) + 10) << "features without a landmark get one";
    EXPECT_EQ(map.landmark_count() + fused, before.landmark_count());
    EXPECT_GT(map.keyframe(KeyframeId{7}).covisible.count(KeyframeId{0}), 0U);
  }
}

}  // namespace
}  // namespace ygslam
