#include "bag/stream_pairing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "bag/lone_images.hpp"
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

/// Images of a topic until its stamps are believed.
constexpr std::size_t kBelieved = 5;

struct Paired {
  std::vector<StampPair> pairs;
  std::size_t most_images_behind = 0;  ///< of colour, when a pair came out
  std::size_t unpaired = 0;
};

void take_all(StreamPairing& pairing, std::size_t colours, Paired& paired) {
  while (const auto pair = pairing.take()) {
    if (!pair->is_whole()) continue;
    paired.pairs.push_back({pair->colour->number, pair->depth->number});
    if (colours > kBelieved)
      paired.most_images_behind =
          std::max(paired.most_images_behind, colours - pair->colour->number);
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
    const auto judged = is_colour ? pairing.add(StreamPairing::kColour, {colour[i], i, {}})
                                  : pairing.add(StreamPairing::kDepth, {depth[j], j, {}});
    EXPECT_TRUE(judged.bad.empty() && !judged.jump);
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

/// Colour and depth in turn, 33 ms apart, by the stamps that a fault gives them.
class Recording {
 public:
  using Fault = std::function<std::int64_t(std::size_t number, std::int64_t stamp_ns)>;
  Recording(std::size_t frames, const Fault& colour, const Fault& depth) {
    for (std::size_t i = 0; i < frames; ++i) {
      const std::int64_t ns = 1000 * kSecond + static_cast<std::int64_t>(i) * 33 * kMs;
      add(StreamPairing::kColour, {{colour(i, ns)}, i, {}});
      add(StreamPairing::kDepth, {{depth(i, ns + 4 * kMs)}, i, {}});
    }
    pairing_.finish();
    take();
  }
  static constexpr std::int64_t kSecond = 1000 * kMs;

  std::vector<std::size_t> colours;     ///< of pairs
  std::vector<std::int64_t> stamps_ns;  ///< of pairs
  std::size_t alone = 0, bad = 0, jumps = 0;
  [[nodiscard]] const StreamPairing& pairing() const { return pairing_; }

 private:
  void add(StreamPairing::Side side, StreamImage image) {
    const auto judged = pairing_.add(side, std::move(image));
    bad += judged.bad.size();
    jumps += judged.jump ? 1 : 0;
    take();
  }
  void take() {
    while (const auto pair = pairing_.take()) {
      alone += pair->is_whole() ? 0 : 1;
      if (!pair->is_whole()) continue;
      EXPECT_EQ(pair->colour->number, pair->depth->number);
      EXPECT_EQ(pair->depth->stamp.ns - pair->colour->stamp.ns, 4 * kMs);
      EXPECT_GT(pair->colour->stamp.ns, stamps_ns.empty() ? -1 : stamps_ns.back());
      colours.push_back(pair->colour->number);
      stamps_ns.push_back(pair->colour->stamp.ns);
    }
  }
  StreamPairing pairing_;
};

std::int64_t right(std::size_t /*number*/, std::int64_t ns) { return ns; }

/// Images from `first` on, `count` of them, are `by_s` elsewhere.
Recording::Fault jump(std::size_t first, std::size_t count, std::int64_t by_s) {
  return [=](std::size_t number, std::int64_t ns) {
    return number >= first && number - first < count ? ns + by_s * Recording::kSecond : ns;
  };
}

TEST(StreamPairing, F11OneStampFarFromTheOthersCostsItsFrameOnly) {
  for (const std::int64_t by_s : {3600, -900, 11, -11}) {
    for (const std::size_t at : {0, 1, 3, 40, 98}) {
      const auto fault = jump(at, 1, by_s);
      for (const auto& [colour, depth] :
           {std::pair(fault, fault), {fault, Recording::Fault(right)}, {right, fault}}) {
        const Recording found(100, colour, depth);
        EXPECT_GE(found.colours.size(), 98U) << by_s << " s at " << at;
        EXPECT_LE(found.stamps_ns.back() - found.stamps_ns.front(), 3700 * Recording::kSecond);
        EXPECT_EQ(found.pairing().shift_ns(), 0) << by_s << " s at " << at;
      }
    }
  }
}

TEST(StreamPairing, WhoCannotWaitGetsTheFirstPairAtOnce) {
  StreamPairing pairing(StampOrder::First::kIsBelieved);
  pairing.add(StreamPairing::kDepth, {{1000 * kMs}, 0, {}});
  pairing.add(StreamPairing::kColour, {{1000 * kMs}, 0, {}});
  const auto pair = pairing.take();
  ASSERT_TRUE(pair && pair->is_whole());
  EXPECT_EQ(pair->colour->stamp.ns, 1000 * kMs);
}

TEST(StreamPairing, F11ClocksThatStayAheadMakeAGap) {
  const Recording found(100, jump(40, 60, 3600), jump(40, 60, 3600));
  EXPECT_EQ(found.colours.size(), 100U);
  EXPECT_EQ(found.jumps, 2U) << "of colour and of depth";
  EXPECT_EQ(found.stamps_ns[40] - found.stamps_ns[39], 3600 * Recording::kSecond + 33 * kMs);
  EXPECT_EQ(found.pairing().shift_ns(), 0);
}

TEST(StreamPairing, F11ClocksThatGoBackForGoodGoOnOneFrameAfterTheLast) {
  for (const std::int64_t by_s : {-900, -1}) {
    const Recording found(100, jump(40, 60, by_s), jump(40, 60, by_s));
    ASSERT_EQ(found.colours.size(), 100U) << by_s;
    EXPECT_EQ(found.stamps_ns[40] - found.stamps_ns[39], 33 * kMs);
    EXPECT_EQ(found.stamps_ns[99] - found.stamps_ns[39], 60 * 33 * kMs);
    EXPECT_EQ(found.pairing().shift_ns(), -by_s * Recording::kSecond);
  }
}

TEST(StreamPairing, F11ClocksThatComeBackAfterSomeFramesLoseNone) {
  const Recording both(100, jump(40, 20, 3600), jump(40, 20, 3600));
  EXPECT_EQ(both.colours.size(), 100U);
  EXPECT_EQ(both.pairing().shift_ns(), 3600 * Recording::kSecond);
  for (const std::int64_t by_s : {3600, -900}) {  // one of them: meanwhile there are no pairs
    const Recording colour(100, jump(40, 20, by_s), right);
    const Recording depth(100, right, jump(40, 20, by_s));
    for (const Recording* found : {&colour, &depth}) {
      EXPECT_GE(found->colours.size(), 75U) << by_s;
      EXPECT_LE(found->colours.size(), 80U) << by_s;
      EXPECT_EQ(found->colours.back(), 99U);
      EXPECT_EQ(found->pairing().shift_ns(), 0) << "the stamps of pairs never went back";
    }
  }
}

TEST(StreamPairing, F11StampsThatStandStillAreToldAndNothingWaitsWithoutEnd) {
  const auto still = [](std::size_t number, std::int64_t ns) {
    return number < 40 ? ns : 1001 * Recording::kSecond;
  };
  const Recording found(1000, still, still);
  EXPECT_GE(found.colours.size(), 40U);
  EXPECT_LE(found.colours.size(), 41U);
  EXPECT_GE(found.bad, 2U * 940U);
}

TEST(StreamPairing, F11StampsAtTheEndsOfTimeOverflowNothing) {
  constexpr std::int64_t kFar = std::numeric_limits<std::int64_t>::max() / 2 - 10 * kMs * 1000;
  const auto fault = [](std::size_t number, std::int64_t ns) {
    return number / 10 % 2 == 0 ? ns : kFar + ns % (100 * Recording::kSecond);
  };
  const Recording found(400, fault, fault);
  EXPECT_GE(found.colours.size(), 100U);
}

TEST(StreamPairing, ASlowCameraIsBelieved) {
  const auto slowly = [](std::size_t number, std::int64_t ns) {
    return ns + static_cast<std::int64_t>(number) * 33 * Recording::kSecond;
  };
  const Recording found(30, slowly, slowly);
  EXPECT_EQ(found.colours.size(), 30U);
  EXPECT_EQ(found.jumps, 0U);
}

TEST(StreamPairing, WhatComesOutOfOrderIsLeftOut) {
  const auto fault = [](std::size_t number, std::int64_t ns) {
    switch (number) {
      case 20:
        return ns - 33 * kMs;  // that of the one before
      case 21:
        return ns - 70 * kMs;
      case 22:
        return std::int64_t{-1};
      case 23:
        return INT64_MAX;
      default:
        return ns;
    }
  };
  const Recording found(60, fault, right);
  EXPECT_EQ(found.colours.size(), 56U);
  EXPECT_EQ(found.bad, 4U);
  EXPECT_EQ(found.alone, 4U) << "the depth images";
}

TEST(StreamPairing, ATopicThatDriesUpCostsNoMemory) {
  StreamPairing pairing;
  std::size_t alone = 0;
  for (int i = 0; i < 1000; ++i) {
    static_cast<void>(pairing.add(StreamPairing::kColour,
                                  {{i * 33 * kMs}, static_cast<std::size_t>(i), Bytes(1000)}));
    while (const auto pair = pairing.take()) {
      EXPECT_TRUE(pair->colour->bytes.empty());
      ++alone;
    }
  }
  EXPECT_GE(alone, 900U);
  EXPECT_EQ(pairing.unpaired_in_a_row(), alone);
  // The newest are still there for a depth topic that comes back.
  for (int i = 995; i < 1000; ++i)
    static_cast<void>(
        pairing.add(StreamPairing::kDepth, {{i * 33 * kMs}, static_cast<std::size_t>(i), {}}));
  std::vector<std::size_t> pairs;
  while (const auto pair = pairing.take())
    if (pair->is_whole()) pairs.push_back(pair->colour->number);
  EXPECT_EQ(pairs, (std::vector<std::size_t>{995, 996, 997, 998, 999}));
  EXPECT_EQ(pairing.unpaired_in_a_row(), 0U);
}

TEST(StreamPairing, LargeImagesAreFewerThatWait) {
  StreamPairing pairing;
  const std::size_t bytes = std::size_t{40} << 20;
  for (int i = 0; i < 8; ++i)
    static_cast<void>(pairing.add(StreamPairing::kColour,
                                  {{i * 33 * kMs}, static_cast<std::size_t>(i), Bytes(bytes)}));
  EXPECT_EQ(pairing.unpaired(), 2U) << "six of 40 MiB fit into 256 MiB";
}

TEST(LoneImages, AFewCostNothingAndARowIsTimeWithoutAFrame) {
  LoneImages lone;
  const auto colour = [&] {
    StreamPair pair;
    pair.colour = StreamImage{};
    return lone.judge(std::move(pair), LoneImages::Fault::kPartner).has_value();
  };
  const auto whole = [&] { return lone.judge({StreamImage{}, StreamImage{}}, {}).has_value(); };
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(colour()) << "depth has not begun";
  EXPECT_TRUE(whole());
  for (int i = 0; i < 29; ++i) EXPECT_FALSE(colour());
  EXPECT_TRUE(whole());
  for (int i = 0; i < 29; ++i) EXPECT_FALSE(colour());
  EXPECT_TRUE(colour());
  std::size_t frames = 1;
  while (lone.take()) ++frames;
  EXPECT_EQ(frames, 30U) << "all of the row";
  EXPECT_TRUE(colour()) << "and what follows";
}

TEST(LoneImages, DepthThatIsAlwaysSlowIsNoFault) {
  LoneImages lone;
  std::size_t lost = 0;
  for (int row = 0; row < 20; ++row) {
    static_cast<void>(lone.judge({StreamImage{}, StreamImage{}}, {}));
    for (int i = 0; i < 60; ++i) {
      StreamPair pair;
      pair.colour = StreamImage{};
      lost += lone.judge(std::move(pair), LoneImages::Fault::kPartner) ? 1 : 0;
      while (lone.take()) ++lost;
    }
  }
  EXPECT_LE(lost, 120U) << "of the first two rows";
}

}  // namespace
}  // namespace ygslam
