// Which landmarks and keyframes go.
#include "mapping/culling.hpp"

#include <gtest/gtest.h>

#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

using map_test::kLevels;
using map_test::kScale;
using map_test::World;

TEST(Culling, LandmarksThatNobodyFindsAgainGo) {
  World world(300, 8);
  auto truth = map_test::true_map(world, 5);
  Map& map = truth.map;
  std::vector<LandmarkId> recent;
  for (const LandmarkId id : truth.landmark)
    if (id != kNoLandmark) recent.push_back(id);
  const LandmarkId overlooked = recent[0];  // predicted often, matched hardly ever
  map.count_seen(overlooked, 100, 2);
  const LandmarkId lonely = recent[1];  // old, seen by one keyframe
  while (map.landmark(lonely).observations.size() > 1)
    map.remove_observation(lonely, map.landmark(lonely).observations.back().keyframe);
  const bool lonely_is_old = index(map.landmark(lonely).first_keyframe) == 0;
  ASSERT_TRUE(lonely_is_old);
  cull_landmarks(map, recent, {});
  EXPECT_FALSE(map.has_landmark(overlooked));
  EXPECT_FALSE(map.has_landmark(lonely));
  for (const LandmarkId id : recent) {
    ASSERT_TRUE(map.has_landmark(id));
    EXPECT_GT(index(map.landmark(id).first_keyframe), 1U) << "the old have passed";
  }
  EXPECT_GT(map.landmark_count(), 150U);
}

TEST(Culling, OnlyKeyframesThatOthersCoverGo) {
  World world(400, 9);
  // Eight keyframes from nearly one place: all but the protected ones are superfluous.
  Map map({kLevels, kScale});
  std::vector<LandmarkId> landmark(world.points().size(), kNoLandmark);
  for (int i = 0; i < 8; ++i) {
    const auto seen = world.see(World::pose(0), static_cast<std::uint32_t>(i));
    const KeyframeId id = map_test::add_keyframe(
        map, seen, i ? KeyframeId{static_cast<std::uint32_t>(i - 1)} : kNoKeyframe);
    for (std::uint32_t k = 0; k < seen.point.size(); ++k) {
      LandmarkId& l = landmark[seen.point[k]];
      if (l == kNoLandmark) {
        l = map.add_landmark(world.points()[seen.point[k]].p_world, id, k);
      } else {
        map.add_observation(l, id, k);
      }
    }
  }
  const CullingConfig config;
  const auto removed = cull_keyframes(map, KeyframeId{7}, config);
  EXPECT_FALSE(removed.empty());
  for (const KeyframeId id : removed) {
    EXPECT_FALSE(map.has_keyframe(id));
    EXPECT_GT(index(id), 0U) << "the first keyframe is the world";
    EXPECT_LT(index(id), 8U - static_cast<unsigned>(config.protected_keyframes));
  }
  // What is left still sees every point as often as the rule asks for.
  EXPECT_GE(map.keyframes().size(), static_cast<std::size_t>(config.redundant_observers));
  // Keyframes of different views all stay.
  World wide(400, 10);
  auto apart = map_test::true_map(wide, 3);
  EXPECT_TRUE(cull_keyframes(apart.map, KeyframeId{2}, config).empty());
}

TEST(Culling, OfALaterVisitLessThatIsNewKeepsAKeyframe) {
  World world(400, 9);
  // The fifth of nine keyframes from one place sees 15 % that no other does.
  const auto keeps_fifth = [&](double visited_after_s) {
    Map map({kLevels, kScale});
    std::vector<LandmarkId> landmark(world.points().size(), kNoLandmark);
    for (int i = 0; i < 9; ++i) {
      auto seen = world.see(World::pose(0), static_cast<std::uint32_t>(i));
      auto frame = *seen.frame;
      frame.stamp.ns = std::int64_t{33'000'000} * i;
      if (i >= 4) frame.stamp.ns += static_cast<std::int64_t>(1e9 * visited_after_s);
      seen.frame = std::make_shared<const RgbdFrame>(frame);
      const KeyframeId id = map_test::add_keyframe(
          map, seen, i ? KeyframeId{static_cast<std::uint32_t>(i - 1)} : kNoKeyframe);
      for (std::uint32_t k = 0; k < seen.point.size(); ++k) {
        LandmarkId& l = landmark[seen.point[k]];
        if (i == 4 && k % 20 < 3) {
          map.add_landmark(world.points()[seen.point[k]].p_world, id, k);
        } else if (l == kNoLandmark) {
          l = map.add_landmark(world.points()[seen.point[k]].p_world, id, k);
        } else {
          map.add_observation(l, id, k);
        }
      }
    }
    cull_keyframes(map, KeyframeId{8}, {});
    return map.has_keyframe(KeyframeId{4});
  };
  EXPECT_TRUE(keeps_fifth(0));
  EXPECT_TRUE(keeps_fifth(5));
  EXPECT_FALSE(keeps_fifth(20));
}

TEST(Culling, WhatKeyframesSeeThroughGoes) {
  World world(300, 14);
  auto truth = map_test::true_map(world, 4);
  Map& map = truth.map;
  const CullingConfig config;
  DepthImage far_m(640, 480), wall_m(640, 480);
  for (float& d : far_m) d = 12;
  for (float& d : wall_m) d = 1;
  const auto keyframe_with = [&](const DepthImage& depth_m) {
    const KeyframeId id = map.next_keyframe_id();
    auto data = std::make_shared<KeyframeData>(*map.keyframe(KeyframeId{3}).data);
    data->id = id;
    data->frame = kNoFrame;
    data->free_space = FreeSpaceImage(depth_m);
    map.add_keyframe(data, World::pose(3), KeyframeId{static_cast<std::uint32_t>(index(id) - 1)},
                     std::vector<float>(data->features->size(), 1));
    return id;
  };
  const std::size_t before = map.landmark_count();
  for (int i = 0; i < config.seen_through; ++i)
    EXPECT_EQ(cull_seen_through(map, world.camera(), keyframe_with(wall_m), config), 0)
        << "what stands before them hides them";
  for (int i = 1; i < config.seen_through; ++i)
    EXPECT_EQ(cull_seen_through(map, world.camera(), keyframe_with(far_m), config), 0);
  const KeyframeId last = keyframe_with(far_m);
  const LandmarkId kept = map.keyframe(KeyframeId{3}).landmarks[0];
  map.add_observation(kept, last, 0);
  const int removed = cull_seen_through(map, world.camera(), last, config);
  EXPECT_GT(removed, 0.8 * static_cast<double>(before));
  EXPECT_TRUE(map.has_landmark(kept)) << "it is still seen";
  EXPECT_EQ(map.landmark_count(), before - static_cast<std::size_t>(removed));
}

}  // namespace
}  // namespace ygslam
