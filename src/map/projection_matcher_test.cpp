#include "map/projection_matcher.hpp"

#include <gtest/gtest.h>

#include <set>

#include "map/map_test_world.hpp"

namespace ygslam {
namespace {

using map_test::World;

std::vector<SearchPoint> search_points(const World& world, double radius_px) {
  std::vector<SearchPoint> points;
  for (std::uint32_t i = 0; i < world.points().size(); ++i) {
    const auto& p = world.points()[i];
    points.push_back(
        {p.p_world, &p.descriptor, 0, map_test::kLevels - 1, radius_px, p.angle_rad, i});
  }
  return points;
}

std::vector<std::uint8_t> all_usable(const map_test::SeenFrame& seen) {
  return std::vector<std::uint8_t>(seen.features->size(), 1);
}

TEST(ProjectionMatcher, FindsTheTrueMatchesOneToOne) {
  World world(800, 1);
  const auto seen = world.see(World::pose(3), 0, {.noise_px = 0.5});
  const auto points = search_points(world, 8);
  const auto matches = match_by_projection(world.camera(), World::pose(3), points, *seen.features,
                                           seen.grid, all_usable(seen), {});
  std::set<std::uint32_t> sources, features;
  std::size_t right = 0;
  for (const PointMatch& m : matches) {
    EXPECT_TRUE(sources.insert(m.source).second);
    EXPECT_TRUE(features.insert(m.feature).second);
    right += seen.point[m.feature] == static_cast<int>(m.source) ? 1 : 0;
    EXPECT_EQ(m.distance,
              distance(world.points()[m.source].descriptor, seen.features->descriptors[m.feature]));
  }
  EXPECT_EQ(right, matches.size());
  EXPECT_GT(right, 0.98 * static_cast<double>(seen.features->size()));
}

TEST(ProjectionMatcher, LooksNoFartherThanTheRadius) {
  World world(500, 2);
  const auto seen = world.see(World::pose(0), 0);
  // The pose is wrong by about 20 px sideways.
  Vec6 shift = Vec6::Zero();
  shift[4] = 20.0 / world.camera().fx();
  const SE3 wrong = SE3::exp(shift) * World::pose(0);
  for (const double radius_px : {5.0, 40.0}) {
    const auto matches = match_by_projection(world.camera(), wrong, search_points(world, radius_px),
                                             *seen.features, seen.grid, all_usable(seen), {});
    for (const PointMatch& m : matches) {
      const Vec2 px = world.camera().project(wrong * world.points()[m.source].p_world);
      const auto error = (px - seen.features->points[m.feature].ideal_px.cast<double>()).norm();
      EXPECT_LE(error, radius_px + 1e-3);
    }
    if (radius_px < 20) {
      EXPECT_LT(matches.size(), 5U);
    } else {
      EXPECT_GT(matches.size(), 0.9 * static_cast<double>(seen.point.size()));
    }
  }
}

TEST(ProjectionMatcher, TakesNeitherUnusableFeaturesNorOtherOctavesNorFarDescriptors) {
  World world(3000, 3);
  const auto seen = world.see(World::pose(0), 0);
  auto usable = all_usable(seen);
  for (std::size_t i = 0; i < usable.size(); i += 2) usable[i] = 0;
  auto points = search_points(world, 8);
  for (SearchPoint& p : points) p.max_octave = 3;
  ProjectionMatcherConfig config;
  config.max_distance = 5;
  const auto matches = match_by_projection(world.camera(), World::pose(0), points, *seen.features,
                                           seen.grid, usable, config);
  ASSERT_GT(matches.size(), 5U);
  for (const PointMatch& m : matches) {
    EXPECT_EQ(m.feature % 2, 1U);
    EXPECT_LE(seen.features->points[m.feature].octave, 3);
    EXPECT_LE(m.distance, 5);
  }
}

TEST(ProjectionMatcher, TheNearerDescriptorWinsAContestedFeature) {
  World world(1, 4);
  world.points()[0].p_world = {0, 0, 2};
  const auto seen = world.see(SE3(), 0, {.blurred_bits = 0});
  ASSERT_EQ(seen.features->size(), 1U);
  const Descriptor good = map_test::blurred(world.points()[0].descriptor, 3, world.rng());
  const Descriptor bad = map_test::blurred(world.points()[0].descriptor, 60, world.rng());
  ProjectionMatcherConfig config;
  config.max_distance = 256;
  for (const bool good_first : {true, false}) {
    const SearchPoint a{{0, 0, 2}, &good, 0, 7, 5, -1, 10}, b{{0, 0, 2}, &bad, 0, 7, 5, -1, 20};
    const std::vector<SearchPoint> points = good_first ? std::vector{a, b} : std::vector{b, a};
    const auto matches = match_by_projection(world.camera(), SE3(), points, *seen.features,
                                             seen.grid, all_usable(seen), config);
    ASSERT_EQ(matches.size(), 1U);
    EXPECT_EQ(matches[0].source, 10U);
  }
}

TEST(ProjectionMatcher, KeepsOnlyTheDominantRotations) {
  World world(400, 5);
  const auto seen = world.see(World::pose(0), 0);
  auto points = search_points(world, 8);
  Rng rng(9);
  // All turned by 0.3 rad, but a fifth at random; some of unknown orientation.
  std::set<std::uint32_t> odd, unknown;
  constexpr float kTurn = 2 * std::numbers::pi_v<float>;
  for (SearchPoint& p : points) {
    float angle = p.angle_rad - 0.3F;
    if (rng.below(5) == 0) {
      odd.insert(p.source);
      angle -= static_cast<float>(rng.uniform(1.0, 5.0));
    }
    while (angle < 0) angle += kTurn;
    p.angle_rad = angle;
    if (rng.below(10) == 0) {
      unknown.insert(p.source);
      p.angle_rad = -1;
    }
  }
  ProjectionMatcherConfig config;
  const auto all = match_by_projection(world.camera(), World::pose(0), points, *seen.features,
                                       seen.grid, all_usable(seen), config);
  config.check_orientation = true;
  const auto kept = match_by_projection(world.camera(), World::pose(0), points, *seen.features,
                                        seen.grid, all_usable(seen), config);
  const auto count = [&](const std::vector<PointMatch>& matches, bool want_odd) {
    return std::count_if(matches.begin(), matches.end(), [&](const PointMatch& m) {
      return !unknown.contains(m.source) && odd.contains(m.source) == want_odd;
    });
  };
  EXPECT_EQ(count(kept, false), count(all, false));
  EXPECT_LT(count(kept, true), 0.35 * static_cast<double>(count(all, true)));
  const auto unknown_kept = std::count_if(
      kept.begin(), kept.end(), [&](const PointMatch& m) { return unknown.contains(m.source); });
  EXPECT_GT(unknown_kept, 0);
}

}  // namespace
}  // namespace ygslam
