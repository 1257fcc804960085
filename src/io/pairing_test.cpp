#include "io/pairing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include "core/rng.hpp"
#include "core/testing/recorded_data.hpp"
#include "io/image_list.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

std::vector<Timestamp> random_stamps(std::size_t count, std::int64_t range_ns, Rng& rng) {
  std::set<std::int64_t> values;
  while (values.size() < count) {
    values.insert(static_cast<std::int64_t>(rng.uniform(0, static_cast<double>(range_ns))));
  }
  std::vector<Timestamp> stamps;
  for (const std::int64_t value : values) stamps.push_back({value});
  return stamps;
}

// The definition, word for word: search all free pairs for the nearest, again and again.
std::vector<StampPair> brute_force(const std::vector<Timestamp>& a, const std::vector<Timestamp>& b,
                                   std::int64_t max_ns) {
  std::vector<bool> used_a(a.size()), used_b(b.size());
  std::vector<StampPair> pairs;
  while (true) {
    std::int64_t best = max_ns + 1;
    StampPair pair;
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j < b.size(); ++j) {
        if (used_a[i] || used_b[j] || std::llabs(a[i].ns - b[j].ns) >= best) continue;
        best = std::llabs(a[i].ns - b[j].ns);
        pair = {i, j};
      }
    }
    if (best > max_ns) break;
    used_a[pair.first] = used_b[pair.second] = true;
    pairs.push_back(pair);
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const auto& x, const auto& y) { return x.first < y.first; });
  return pairs;
}

TEST(Pairing, AgreesWithBruteForceOnRandomStamps) {
  Rng rng(11);
  for (int round = 0; round < 300; ++round) {
    const auto a = random_stamps(1 + rng.below(25), 1'000'000'000, rng);
    const auto b = random_stamps(1 + rng.below(25), 1'000'000'000, rng);
    const std::int64_t max_ns = static_cast<std::int64_t>(rng.below(100)) * 1'000'000;
    ASSERT_EQ(pair_one_to_one(a, b, max_ns), brute_force(a, b, max_ns)) << "round " << round;
  }
}

TEST(Pairing, TakesNoStampTwiceAndNothingTooFar) {
  Rng rng(12);
  const auto a = random_stamps(500, 10'000'000'000, rng);
  const auto b = random_stamps(700, 10'000'000'000, rng);
  std::set<std::size_t> seen;
  for (const StampPair& pair : pair_one_to_one(a, b, kMaxPairDifference_ns)) {
    EXPECT_TRUE(seen.insert(pair.second).second);
    EXPECT_LE(std::llabs(a[pair.first].ns - b[pair.second].ns), kMaxPairDifference_ns);
  }
  EXPECT_GT(seen.size(), a.size() / 2);
}

TEST(Pairing, EmptyListsMakeNoPairs) {
  const std::vector<Timestamp> one = {{5}};
  EXPECT_TRUE(pair_one_to_one({}, one, 10).empty());
  EXPECT_TRUE(pair_one_to_one(one, {}, 10).empty());
  EXPECT_FALSE(estimate_offset_ns(one, {}).has_value());
}

TEST(Offset, F12IsFoundFromTheStampsAlone) {
  Rng rng(13);
  for (const std::int64_t offset_ms : {-200, -50, 0, 14, 50, 120}) {
    std::vector<Timestamp> a, b;
    for (int i = 0; i < 200; ++i) {
      const auto jitter = [&] { return static_cast<std::int64_t>(rng.uniform(-1e6, 1e6)); };
      const std::int64_t t = 1'000'000'000'000 + i * std::int64_t{33'333'333};
      if (rng.below(10) != 0) a.push_back({t + jitter()});
      if (rng.below(10) != 0) b.push_back({t + offset_ms * 1'000'000 + jitter()});
    }
    // Regular stamps tell the offset only up to whole frame intervals; without drops the full count
    // decides, with drops any of them may win.
    const auto found = estimate_offset_ns(a, b);
    ASSERT_TRUE(found.has_value());
    const double frames = static_cast<double>(*found - offset_ms * 1'000'000) / 33'333'333.0;
    EXPECT_NEAR(frames, std::round(frames), 0.05) << offset_ms;
  }
}

TEST(Offset, F12IsExactForListsOfTheSameLength) {
  std::vector<Timestamp> a, b;
  for (int i = 0; i < 100; ++i) {
    a.push_back({i * std::int64_t{33'333'333}});
    b.push_back({i * std::int64_t{33'333'333} + 50'000'000});
  }
  EXPECT_NEAR(static_cast<double>(*estimate_offset_ns(a, b)), 50e6, 1e6);
}

TEST(Offset, F12ClocksThatPassEachOtherHaveNone) {
  for (const double rate : {1.005, 1.0005, 0.999, 1.03})
    for (const int count : {60, 280, 930})
      for (const double phase_ms : {-14.0, -6.0, 0.0, 9.0, 16.0}) {
        std::vector<Timestamp> a, b;
        for (int i = 0; i < count; ++i) {
          a.push_back({to_ns(1000 + i / 29.83)});
          b.push_back({to_ns(1000 + phase_ms * 1e-3 + i / (29.83 * rate))});
        }
        const auto found = estimate_offset_ns(a, b);
        if (found) {
          EXPECT_LE(std::llabs(*found), kMaxPairDifference_ns)
              << rate << " " << count << " " << phase_ms;
        }
      }
}

TEST(Pairing, GivesTheOfficialAssociationsOfTheRecordedLists) {
  const auto folder = testing::shared_folder() / "data" / "associations";
  YGSLAM_NEEDS_RECORDED(folder);
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    const auto official = parse_associations(testing::read(file.path()));
    ASSERT_GT(official.entries.size(), 100U) << file.path();
    std::vector<Timestamp> colour, depth;
    for (const ListedPair& pair : official.entries) {
      colour.push_back(pair.colour.stamp);
      depth.push_back(pair.depth.stamp);
    }
    if (!std::is_sorted(depth.begin(), depth.end())) continue;
    const auto pairs = pair_one_to_one(colour, depth, kMaxPairDifference_ns);
    ASSERT_EQ(pairs.size(), colour.size()) << file.path();
    for (std::size_t i = 0; i < pairs.size(); ++i) EXPECT_EQ(pairs[i], (StampPair{i, i}));
  }
}

}  // namespace
}  // namespace ygslam
