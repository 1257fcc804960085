#include "bag/stream_pairing.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/rng.hpp"
#include "io/pairing.hpp"

namespace ygslam {
namespace {

using Stamps = std::vector<Timestamp>;
constexpr std::int64_t kMs = 1'000'000;

/// A topic at 30 Hz whose stamps tremble; some images are missing.
Stamps topic(Rng& rng, std::int64_t first_ns, std::int64_t trembles_ns) {
  Stamps stamps;
  for (int i = 0; i < 60; ++i) {
    const std::int64_t ns =
        first_ns + i * 33 * kMs +
        static_cast<std::int64_t>(rng.below(static_cast<std::uint32_t>(trembles_ns)));
    if (rng.below(8) != 0) stamps.push_back({ns});
  }
  return stamps;
}

struct Paired {
  std::vector<StampPair> pairs;
  std::size_t most_images_behind = 0;  ///< of colour, when a pair came out
  std::size_t unpaired = 0;
};

void take_all(StreamPairing& pairing, std::size_t colours, Paired& paired) {
  while (const auto pair = pairing.take()) {
    paired.pairs.push_back({pair->colour.number, pair->depth.number});
    paired.most_images_behind = std::max(paired.most_images_behind, colours - pair->colour.number);
  }
}

/// As they come: merged in order of time, depth `late_ns` after it was taken.
Paired streamed(const Stamps& colour, const Stamps& depth, std::int64_t late_ns) {
  StreamPairing pairing;
  Paired paired;
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < colour.size() || j < depth.size()) {
    const bool is_colour =
        j == depth.size() || (i < colour.size() && colour[i].ns <= depth[j].ns + late_ns);
    EXPECT_TRUE(is_colour ? pairing.add(StreamPairing::kColour, {colour[i], i, {}})
                          : pairing.add(StreamPairing::kDepth, {depth[j], j, {}}));
    is_colour ? ++i : ++j;
    take_all(pairing, i, paired);
  }
  pairing.finish();
  take_all(pairing, i, paired);
  paired.unpaired = pairing.unpaired();
  return paired;
}

TEST(StreamPairing, FindsThePairsOfTheWholeLists) {
  Rng rng(11);
  for (const std::int64_t offset_ms : {0, 3, 12, 16, 20, 40}) {
    for (const std::int64_t trembles_ns : {std::int64_t{1}, 2 * kMs, 22 * kMs}) {
      for (const std::int64_t late_ms : {0, 50, 400}) {
        const Stamps colour = topic(rng, 100 * kMs, trembles_ns);
        const Stamps depth = topic(rng, (100 + offset_ms) * kMs, trembles_ns);
        const auto expected = pair_one_to_one(colour, depth, kMaxPairDifference_ns);
        const Paired found = streamed(colour, depth, late_ms * kMs);
        EXPECT_EQ(found.pairs, expected) << offset_ms << ' ' << trembles_ns << ' ' << late_ms;
        EXPECT_EQ(found.unpaired, colour.size() - expected.size());
      }
    }
  }
}

TEST(StreamPairing, WhatBelongsTogetherWaitsForNothing) {
  Stamps colour;
  Stamps depth;
  for (int i = 0; i < 30; ++i) {
    colour.push_back({i * 33 * kMs});
    depth.push_back({i * 33 * kMs + 4 * kMs});
  }
  const Paired found = streamed(colour, depth, 0);
  EXPECT_EQ(found.pairs.size(), 30U);
  EXPECT_EQ(found.most_images_behind, 1U) << "the pair's own colour image";
}

TEST(StreamPairing, WhatComesOutOfOrderIsLeftOut) {
  StreamPairing pairing;
  EXPECT_TRUE(pairing.add(StreamPairing::kColour, {{5 * kMs}, 0, {}}));
  EXPECT_FALSE(pairing.add(StreamPairing::kColour, {{5 * kMs}, 1, {}}));
  EXPECT_FALSE(pairing.add(StreamPairing::kColour, {{4 * kMs}, 2, {}}));
  EXPECT_FALSE(pairing.add(StreamPairing::kDepth, {{-1}, 0, {}}));
  EXPECT_FALSE(pairing.add(StreamPairing::kDepth, {{INT64_MAX}, 0, {}}));
  EXPECT_TRUE(pairing.add(StreamPairing::kDepth, {{5 * kMs}, 1, {}}));
  const auto pair = pairing.take();
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->colour.number, 0U);
  EXPECT_EQ(pair->depth.number, 1U);
}

TEST(StreamPairing, ATopicThatDriesUpCostsNoMemory) {
  StreamPairing pairing;
  for (int i = 0; i < 1000; ++i)
    EXPECT_TRUE(pairing.add(StreamPairing::kColour,
                            {{i * 33 * kMs}, static_cast<std::size_t>(i), Bytes(1000)}));
  EXPECT_GE(pairing.unpaired_in_a_row(), 900U);
  // The newest are still there for a depth topic that comes back.
  EXPECT_TRUE(pairing.add(StreamPairing::kDepth, {{999 * 33 * kMs}, 0, {}}));
  const auto pair = pairing.take();
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->colour.number, 999U);
  EXPECT_EQ(pairing.unpaired_in_a_row(), 0U);
}

TEST(StreamPairing, LargeImagesAreFewerThatWait) {
  StreamPairing pairing;
  const std::size_t bytes = std::size_t{40} << 20;
  for (int i = 0; i < 8; ++i)
    EXPECT_TRUE(pairing.add(StreamPairing::kColour,
                            {{i * 33 * kMs}, static_cast<std::size_t>(i), Bytes(bytes)}));
  EXPECT_EQ(pairing.unpaired(), 2U) << "six of 40 MiB fit into 256 MiB";
}

}  // namespace
}  // namespace ygslam
