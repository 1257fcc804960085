#include "eval/truth_boxes.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

constexpr int kPersonId = 1, kChairId = 2;

DynamicTruth frame(int side_px, bool chair_moves) {
  DynamicTruth truth{GreyImage(200, 100), GreyImage(200, 100)};
  for (int v = 0; v < side_px; ++v) {
    for (int u = 0; u < side_px; ++u) {
      truth.ids.at(u, v) = kPersonId;
      truth.ids.at(100 + u, v) = kChairId;
      truth.moving.at(100 + u, v) = chair_moves ? 255 : 0;
    }
  }
  return truth;
}

Timestamp stamp_at(double s) { return {to_ns(s)}; }

TEST(TruthBoxes, PersonsCountAlwaysOtherThingsWhileAndShortlyAfterTheyMove) {
  std::array<bool, 256> movable{};
  movable[kPersonId] = true;
  TruthBoxes truth(movable);
  const auto counts = [&](double s, bool chair_moves) {
    const auto boxes = truth.step(stamp_at(s), frame(40, chair_moves));
    EXPECT_EQ(boxes.size(), 2U);
    EXPECT_EQ(boxes[1].box.x0, 100);
    EXPECT_EQ(boxes[1].box.x1, 140);
    EXPECT_EQ(boxes[1].box.height(), 40);
    EXPECT_TRUE(boxes[0].counts);
    return boxes[1].counts;
  };
  EXPECT_FALSE(counts(0, false));
  EXPECT_TRUE(counts(0.1, true));
  EXPECT_TRUE(counts(1.0, false));
  EXPECT_FALSE(counts(1.2, false));
}

TEST(TruthBoxes, WhatTouchesAPersonMayBePartOfThePerson) {
  std::array<bool, 256> movable{};
  movable[kPersonId] = true;
  TruthBoxes truth(movable);
  DynamicTruth touching = frame(40, true);
  EXPECT_TRUE(truth.step(stamp_at(0), touching)[1].counts);
  for (int u = 40; u < 110; ++u) touching.ids.at(u, 20) = kPersonId;
  EXPECT_FALSE(truth.step(stamp_at(0.1), touching)[1].counts);
}

TEST(TruthBoxes, WhatIsHardlyVisibleNeedNotBeFound) {
  std::array<bool, 256> movable{};
  movable.fill(true);
  TruthBoxes truth(movable);
  EXPECT_FALSE(truth.step(stamp_at(0), frame(31, true))[0].counts);
  EXPECT_TRUE(truth.step(stamp_at(0), frame(32, true))[0].counts);
}

}  // namespace
}  // namespace ygslam
