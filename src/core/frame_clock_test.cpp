#include "core/frame_clock.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

constexpr std::int64_t kStep_ns = 33'000'000;
constexpr std::int64_t kStart_ns = 1'000'000'000'000;

/// Ten frames that begin at kStart_ns.
FrameClock running_clock() {
  FrameClock clock;
  for (int i = 0; i < 10; ++i)
    EXPECT_EQ(clock.step({kStart_ns + i * kStep_ns}).stamp->ns, kStart_ns + i * kStep_ns);
  return clock;
}
constexpr std::int64_t kLast_ns = kStart_ns + 9 * kStep_ns;

TEST(FrameClock, AStampThatGoesBackAloneIsRefusedAndTheNextIsBelieved) {
  FrameClock clock = running_clock();
  EXPECT_FALSE(clock.step({kLast_ns}).stamp) << "twice the same";
  EXPECT_FALSE(clock.step({kLast_ns - kStep_ns}).stamp);
  EXPECT_FALSE(clock.step({-5}).stamp);
  EXPECT_EQ(clock.step({kLast_ns + kStep_ns}).stamp->ns, kLast_ns + kStep_ns);
  EXPECT_EQ(clock.shift_ns(), 0);
}

TEST(FrameClock, AClockThatWasSetBackIsBelievedWithinFiveFramesAndTimeGoesOn) {
  FrameClock clock = running_clock();
  const std::int64_t set_ns = kLast_ns - 500'000'000'000;
  for (int i = 0; i < 4; ++i) EXPECT_FALSE(clock.step({set_ns + i * kStep_ns}).stamp) << i;
  const auto believed = clock.step({set_ns + 4 * kStep_ns});
  EXPECT_TRUE(believed.was_set_back);
  EXPECT_EQ(believed.stamp->ns, kLast_ns + kStep_ns);
  const auto next = clock.step({set_ns + 5 * kStep_ns});
  EXPECT_FALSE(next.was_set_back);
  EXPECT_EQ(next.stamp->ns, kLast_ns + 2 * kStep_ns) << "spaced as they came";
  EXPECT_EQ(clock.shift_ns(), next.stamp->ns - (set_ns + 5 * kStep_ns));
}

TEST(FrameClock, StampsThatDoNotAgreeStayRefused) {
  FrameClock clock = running_clock();
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(clock.step({kLast_ns - i * kStep_ns}).stamp) << i;
}

TEST(FrameClock, OneFrameFarAheadCostsFourFramesNotAllThatFollow) {
  FrameClock clock = running_clock();
  EXPECT_TRUE(clock.step({kLast_ns + 3'600'000'000'000}).stamp);
  int refused = 0;
  for (int i = 1; i <= 20; ++i) refused += clock.step({kLast_ns + i * kStep_ns}).stamp ? 0 : 1;
  EXPECT_EQ(refused, 4);
}

TEST(FrameClock, AfterARestartWhateverComesIsBelieved) {
  FrameClock clock = running_clock();
  clock.restart();
  const auto first = clock.step({7});
  EXPECT_TRUE(first.was_set_back);
  EXPECT_EQ(first.stamp->ns, kLast_ns + kStep_ns);
  EXPECT_EQ(clock.step({7 + kStep_ns}).stamp->ns, kLast_ns + 2 * kStep_ns);
  clock.restart();
  const auto later = clock.step({kLast_ns + 9 * kStep_ns});
  EXPECT_FALSE(later.was_set_back) << "what goes on needs no belief";
}

}  // namespace
}  // namespace ygslam
