#include "features/matcher.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "features/features_testing.hpp"

namespace ygslam {
namespace {

Features described_features(std::size_t count, Rng& rng) {
  Features f;
  for (std::size_t i = 0; i < count; ++i) {
    f.points.emplace_back();
    f.descriptors.push_back(testing::random_descriptor(rng));
  }
  return f;
}

Descriptor with_flipped_bits(Descriptor d, int count, Rng& rng) {
  std::set<std::uint32_t> flipped;
  while (static_cast<int>(flipped.size()) < count) flipped.insert(rng.below(256));
  for (const std::uint32_t bit : flipped) d.bits[bit / 64] ^= std::uint64_t{1} << (bit % 64);
  return d;
}

TEST(Matcher, DistanceCountsFlippedBits) {
  Rng rng(1);
  for (const int flips : {0, 1, 17, 128, 256}) {
    const Descriptor d = testing::random_descriptor(rng);
    EXPECT_EQ(distance(d, with_flipped_bits(d, flips, rng)), flips);
  }
}

TEST(Matcher, RecoversAPermutationUnderNoise) {
  Rng rng(2);
  const Features a = described_features(200, rng);
  Features b = a;
  for (std::size_t i = 0; i < b.size(); ++i) {
    b.descriptors[(i * 37 + 5) % 200] = with_flipped_bits(a.descriptors[i], 30, rng);
  }
  const auto matches = match_brute_force(a, b);
  ASSERT_EQ(matches.size(), 200U);
  for (const Match& m : matches) {
    EXPECT_EQ(m.b, (m.a * 37 + 5) % 200);
    EXPECT_EQ(m.distance, 30);
  }
}

TEST(Matcher, MutualMatchingIsSymmetric) {
  Rng rng(3);
  const Features a = described_features(150, rng);
  const Features b = described_features(180, rng);
  const MatchConfig config{.max_distance = 256, .max_ratio = 1};
  std::set<std::pair<std::uint32_t, std::uint32_t>> forth, back;
  for (const Match& m : match_brute_force(a, b, config)) forth.emplace(m.a, m.b);
  for (const Match& m : match_brute_force(b, a, config)) back.emplace(m.b, m.a);
  EXPECT_EQ(forth, back);
  EXPECT_GT(forth.size(), 20U);
}

TEST(Matcher, EachTestOnlyTakesAway) {
  Rng rng(4);
  const Features a = described_features(100, rng);
  const Features b = described_features(100, rng);
  const MatchConfig open{.max_distance = 256, .max_ratio = 1, .mutual = false};
  EXPECT_EQ(match_brute_force(a, b, open).size(), 100U);
  MatchConfig near = open;
  near.max_distance = 95;
  for (const Match& m : match_brute_force(a, b, near)) EXPECT_LE(m.distance, 95);
  MatchConfig distinct = open;
  distinct.max_ratio = 0.95;
  const auto kept = match_brute_force(a, b, distinct);
  EXPECT_LT(kept.size(), 100U);
  for (const Match& m : kept) {
    EXPECT_LT(m.distance, 0.95 * best_two(a.descriptors[m.a], b.descriptors).second_distance);
  }
}

TEST(Matcher, RatioTestRejectsTwins) {
  Rng rng(5);
  const Features a = described_features(1, rng);
  Features b = a;
  b.points.push_back(b.points[0]);
  b.descriptors.push_back(with_flipped_bits(a.descriptors[0], 1, rng));
  b.descriptors[0] = with_flipped_bits(a.descriptors[0], 1, rng);
  EXPECT_TRUE(match_brute_force(a, b).empty());
}

TEST(Matcher, BestTwoOfCandidatesLooksAtThemOnly) {
  Rng rng(6);
  const Features f = described_features(50, rng);
  const Descriptor query = testing::random_descriptor(rng);
  const std::vector<std::uint32_t> candidates = {3, 17, 29, 44};
  const BestTwo best = best_two(query, f.descriptors, candidates);
  std::multiset<int> distances;
  for (const std::uint32_t i : candidates) distances.insert(distance(query, f.descriptors[i]));
  EXPECT_EQ(best.distance, *distances.begin());
  EXPECT_EQ(best.second_distance, *std::next(distances.begin()));
  EXPECT_EQ(distance(query, f.descriptors[best.index]), best.distance);
  EXPECT_FALSE(best_two(query, f.descriptors, {}).passes(256, 1));
}

TEST(Matcher, CommonRotationDropsTheOthers) {
  Rng rng(7);
  Features a = described_features(60, rng);
  Features b = a;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double turn = i < 40 ? 6.2 + rng.uniform(-0.05, 0.05) : rng.uniform(1.0, 5.0);
    a.points[i].angle_rad = static_cast<float>(rng.uniform(0, 6.28));
    b.points[i].angle_rad =
        static_cast<float>(std::fmod(a.points[i].angle_rad + turn, 2 * std::numbers::pi));
  }
  MatchConfig config;
  config.max_rotation_rad = 0.2;
  const auto matches = match_brute_force(a, b, config);
  EXPECT_EQ(matches.size(), 40U);
  for (const Match& m : matches) EXPECT_LT(m.a, 40U);
}

TEST(Matcher, NothingMatchesNothing) {
  Rng rng(8);
  const Features some = described_features(5, rng);
  const Features none;
  const MatchConfig config{.max_distance = 256, .max_ratio = 1, .max_rotation_rad = 0.3};
  EXPECT_TRUE(match_brute_force(some, none, config).empty());
  EXPECT_TRUE(match_brute_force(none, some, config).empty());
  EXPECT_TRUE(match_brute_force(none, none, config).empty());
}

}  // namespace
}  // namespace ygslam
