#include "core/rng.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "core/time.hpp"

namespace ygslam {
namespace {

TEST(Rng, SameSeedSameNumbersAndOtherSeedOthers) {
  Rng a(42), b(42), c(43);
  int same = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto value = a.next();
    EXPECT_EQ(value, b.next());
    same += value == c.next() ? 1 : 0;
  }
  EXPECT_EQ(same, 0);
}

TEST(Rng, IsSplitMix64) {
  // First outputs for seed 1234567 as published with the reference implementation.
  Rng rng(1234567);
  EXPECT_EQ(rng.next(), 6457827717110365317ULL);
  EXPECT_EQ(rng.next(), 3203168211198807973ULL);
  EXPECT_EQ(rng.next(), 9817491932198370423ULL);
}

TEST(Rng, BelowHitsEveryValueEvenlyAndNoOther) {
  Rng rng(1);
  for (const std::uint32_t n : {1U, 2U, 7U, 100U}) {
    std::vector<int> count(n);
    const int draws = 2000 * static_cast<int>(n);
    for (int i = 0; i < draws; ++i) {
      const std::uint32_t value = rng.below(n);
      ASSERT_LT(value, n);
      ++count[value];
    }
    for (const int c : count) EXPECT_NEAR(c, 2000, 300);  // 6 sigma and more
  }
  for (int i = 0; i < 1000; ++i) EXPECT_LT(rng.below(0xffffffffU), 0xffffffffU);
}

TEST(Rng, UniformStaysInRangeWithTheRightMoments) {
  Rng rng(2);
  double sum = 0, squares = 0;
  constexpr int kDraws = 100000;
  for (int i = 0; i < kDraws; ++i) {
    const double value = rng.uniform(-3, 5);
    ASSERT_GE(value, -3);
    ASSERT_LT(value, 5);
    sum += value;
    squares += value * value;
  }
  const double mean = sum / kDraws;
  EXPECT_NEAR(mean, 1.0, 0.05);
  EXPECT_NEAR(squares / kDraws - mean * mean, 64.0 / 12, 0.1);
}

TEST(Rng, NormalHasItsMomentsAndTails) {
  Rng rng(3);
  double sum = 0, squares = 0;
  int beyond_two_sigma = 0;
  constexpr int kDraws = 100000;
  for (int i = 0; i < kDraws; ++i) {
    const double value = rng.normal(2, 0.5);
    ASSERT_TRUE(std::isfinite(value));
    sum += value;
    squares += (value - 2) * (value - 2);
    beyond_two_sigma += std::abs(value - 2) > 1.0 ? 1 : 0;
  }
  EXPECT_NEAR(sum / kDraws, 2.0, 0.01);
  EXPECT_NEAR(squares / kDraws, 0.25, 0.01);
  EXPECT_NEAR(beyond_two_sigma / static_cast<double>(kDraws), 0.0455, 0.004);
}

TEST(Time, SecondsAndNanosecondsAgreeAndRound) {
  EXPECT_EQ(to_ns(1.5), 1'500'000'000);
  EXPECT_EQ(to_ns(-1.5), -1'500'000'000);
  EXPECT_EQ(to_ns(0.1 + 0.2), 300'000'000);
  // Stamps of today leave no room for a double's rounding of the difference.
  const Timestamp a{1'305'031'102'175'304'001}, b{1'305'031'102'175'304'000};
  EXPECT_DOUBLE_EQ(seconds_between(a, b), 1e-9);
  EXPECT_DOUBLE_EQ(seconds_between(b, a), -1e-9);
}

}  // namespace
}  // namespace ygslam
