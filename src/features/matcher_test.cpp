#include "features/matcher.hpp"

#include <gtest/gtest.h>

#include <algorithm>
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
  const auto open = match_brute_force(a, b, {.max_distance = 256, .max_ratio = 1});
  const auto is_open = [&](const Match& m) { return std::ranges::count(open, m) == 1; };
  const int limit = open[open.size() / 2].distance;
  const auto near = match_brute_force(a, b, {.max_distance = limit, .max_ratio = 1});
  const auto distinct = match_brute_force(a, b, {.max_distance = 256, .max_ratio = 0.95});
  EXPECT_TRUE(std::ranges::all_of(near, is_open));
  EXPECT_TRUE(std::ranges::all_of(distinct, is_open));
  EXPECT_EQ(std::ssize(near),
            std::ranges::count_if(open, [&](const Match& m) { return m.distance <= limit; }));
  EXPECT_GT(near.size(), 0U);
  EXPECT_LT(near.size(), open.size());
  EXPECT_GT(distinct.size(), 0U);
  EXPECT_LT(distinct.size(), open.size());
  for (const Match& m : distinct) {
    std::multiset<int> distances;
    for (const Descriptor& d : b.descriptors) distances.insert(distance(a.descriptors[m.a], d));
    EXPECT_EQ(m.distance, *distances.begin());
    EXPECT_LT(m.distance, 0.95 * *std::next(distances.begin()));
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

TEST(Matcher, NothingMatchesNothing) {
  Rng rng(8);
  const Features some = described_features(5, rng);
  const Features none;
  const MatchConfig config{.max_distance = 256, .max_ratio = 1};
  EXPECT_TRUE(match_brute_force(some, none, config).empty());
  EXPECT_TRUE(match_brute_force(none, some, config).empty());
  EXPECT_TRUE(match_brute_force(none, none, config).empty());
}

}  // namespace
}  // namespace ygslam
