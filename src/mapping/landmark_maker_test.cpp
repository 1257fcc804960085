#include "mapping/landmark_maker.hpp"

#include <gtest/gtest.h>

#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;

TEST(MakeFromDepth, EveryStaticFeatureWithDepthBecomesALandmarkAtItsPlace) {
  World world(600, 2);
  Map map({map_test::kLevels, map_test::kScale});
  const auto seen = world.see(World::pose(4), 0, {.depth_share = 0.7});
  const KeyframeId id = map_test::add_keyframe(map, seen, kNoKeyframe);
  std::vector<float> weight(seen.features->size(), 1.0F);
  for (std::size_t i = 0; i < weight.size(); i += 3) weight[i] = 0.2F;
  map.set_static_weight(id, weight);
  std::vector<LandmarkId> made;
  make_from_depth(map, world.camera(), id, {}, made);
  std::size_t expected = 0;
  for (std::uint32_t i = 0; i < weight.size(); ++i) {
    const bool wanted = seen.features->points[i].depth_m > 0 && weight[i] >= 0.5F;
    expected += wanted ? 1 : 0;
    const LandmarkId landmark = map.keyframe(id).landmarks[i];
    ASSERT_EQ(landmark != kNoLandmark, wanted);
    if (!wanted) continue;
    EXPECT_LT((map.landmark(landmark).p_world - world.points()[seen.point[i]].p_world).norm(),
              1e-3);
  }
  EXPECT_EQ(made.size(), expected);
  make_from_depth(map, world.camera(), id, {}, made);
  EXPECT_EQ(made.size(), expected) << "nothing twice";
}

TEST(MakeFromDepth, FarDepthMakesLandmarksTooForItHoldsTheRotation) {
  World world(600, 3);
  for (auto& p : world.points()) p.p_world.z() += 2.3;  // 3.8 to 7.3 m
  Map map({map_test::kLevels, map_test::kScale});
  const auto seen = world.see(SE3(), 0);
  const KeyframeId id = map_test::add_keyframe(map, seen, kNoKeyframe);
  std::vector<LandmarkId> made;
  make_from_depth(map, world.camera(), id, {}, made);
  EXPECT_EQ(made.size(), seen.features->size());
}

TEST(MakeFromDepth, BeyondTheCloseDepthOnlyTheNearestOfASmallNumber) {
  World world(600, 4);
  Map map({map_test::kLevels, map_test::kScale});
  const auto seen = world.see(SE3(), 0);
  const KeyframeId id = map_test::add_keyframe(map, seen, kNoKeyframe);
  LandmarkMakerConfig config;
  config.close_depth_m = 1.0;  // nothing is that near
  config.min_from_depth = 50;
  std::vector<LandmarkId> made;
  make_from_depth(map, world.camera(), id, config, made);
  ASSERT_EQ(made.size(), 50U);
  float farthest_made = 0, nearest_left = 100;
  for (std::uint32_t i = 0; i < seen.features->size(); ++i) {
    const float depth_m = seen.features->points[i].depth_m;
    if (map.keyframe(id).landmarks[i] != kNoLandmark) {
      farthest_made = std::max(farthest_made, depth_m);
    } else {
      nearest_left = std::min(nearest_left, depth_m);
    }
  }
  EXPECT_LE(farthest_made, nearest_left);
}

TEST(MakeByTriangulation, FindsPointsWithoutDepthNearTheirTruePlace) {
  World world(700, 5);
  // Half of the points are known, so that the keyframes are neighbours; the rest has no landmark.
  Map map({map_test::kLevels, map_test::kScale});
  std::vector<map_test::SeenFrame> seen;
  std::vector<LandmarkId> known(world.points().size(), kNoLandmark);
  for (int i = 0; i < 2; ++i) {
    seen.push_back(
        world.see(World::pose(8 * i), static_cast<std::uint32_t>(i), {.depth_share = 0}));
    const KeyframeId id = map_test::add_keyframe(map, seen.back(), i ? KeyframeId{0} : kNoKeyframe);
    for (std::uint32_t k = 0; k < seen.back().point.size(); ++k) {
      const int p = seen.back().point[k];
      if (p % 2) continue;
      if (known[p] == kNoLandmark) {
        known[p] = map.add_landmark(world.points()[p].p_world, id, k);
      } else {
        map.add_observation(known[p], id, k);
      }
    }
  }
  std::vector<LandmarkId> made;
  make_by_triangulation(map, world.camera(), KeyframeId{1}, {}, made);
  EXPECT_GT(made.size(), 80U);
  int right = 0;
  for (const LandmarkId id : made) {
    const Landmark& landmark = map.landmark(id);
    ASSERT_EQ(landmark.observations.size(), 2U);
    const int p0 = seen[0].point[landmark.observations[0].feature];
    const int p1 = seen[1].point[landmark.observations[1].feature];
    if (p0 == p1 && (landmark.p_world - world.points()[p0].p_world).norm() < 0.02) ++right;
  }
  EXPECT_GT(right, 0.98 * static_cast<double>(made.size()));
}

}  // namespace
}  // namespace ygslam
