#include "eval/dynamic_score.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace ygslam {
namespace {

// A 40 x 30 image with instance 1 on the left half and instance 2 on the lower right.
DynamicTruth two_things() {
  DynamicTruth truth{GreyImage(40, 30), GreyImage(40, 30)};
  for (int v = 0; v < 30; ++v)
    for (int u = 0; u < 40; ++u) truth.ids.at(u, v) = u < 20 ? 1 : v < 15 ? 0 : 2;
  return truth;
}

TEST(DynamicScore, PointsOfAMovingThingAreFoundOrMissed) {
  DynamicTruth truth = two_things();
  truth.moving = {};
  const std::vector<JudgedPoint> points{{{10, 10}, true},  {{10, 20}, true}, {{8, 8}, false},
                                        {{30, 5}, true},   {{32, 6}, false}, {{34, 6}, false},
                                        {{30, 25}, false}, {{-5, 3}, true}};
  const PointCounts counts = count_points(points, truth);
  EXPECT_EQ(counts.found, 2U);
  EXPECT_EQ(counts.missed, 2U);
  EXPECT_EQ(counts.false_alarms, 1U);
  EXPECT_EQ(counts.standing, 2U);
  EXPECT_EQ(counts.left_out, 1U);
  EXPECT_DOUBLE_EQ(counts.recall(), 0.5);
  EXPECT_DOUBLE_EQ(counts.precision(), 2.0 / 3.0);
}

TEST(DynamicScore, AThingAtRestIsLeftOut) {
  DynamicTruth truth = two_things();
  for (int v = 15; v < 30; ++v)
    for (int u = 20; u < 40; ++u) truth.moving.at(u, v) = 255;
  const std::vector<JudgedPoint> points{{{10, 10}, true}, {{10, 20}, false}, {{30, 25}, true}};
  const PointCounts counts = count_points(points, truth);
  EXPECT_EQ(counts.left_out, 2U);
  EXPECT_EQ(counts.found, 1U);
  EXPECT_DOUBLE_EQ(counts.precision(), 1.0);
}

TEST(DynamicScore, PointsWithinThreePixelsOfAnEdgeAreLeftOut) {
  DynamicTruth truth = two_things();
  truth.moving = {};
  for (int u = 0; u < 40; ++u) {
    const std::vector<JudgedPoint> points{{{static_cast<float>(u), 5}, true}};
    EXPECT_EQ(count_points(points, truth).left_out, u >= 17 && u <= 22 ? 1U : 0U) << u;
  }
}

TEST(DynamicScore, NothingToFindIsFullRecall) {
  const PointCounts counts;
  EXPECT_DOUBLE_EQ(counts.recall(), 1.0);
  EXPECT_DOUBLE_EQ(counts.precision(), 1.0);
}

TEST(DynamicScore, OverlapIsIntersectionOverUnion) {
  GreyImage a(10, 10);
  GreyImage b(10, 10);
  for (int v = 0; v < 10; ++v) {
    for (int u = 0; u < 6; ++u) a.at(u, v) = 3;
    for (int u = 4; u < 10; ++u) b.at(u, v) = 255;
  }
  EXPECT_DOUBLE_EQ(overlap(a, b).iou(), 0.2);
  EXPECT_DOUBLE_EQ(overlap(GreyImage(4, 4), GreyImage(4, 4)).iou(), 1.0);
  MaskOverlap sum = overlap(a, a);
  sum += overlap(a, b);
  EXPECT_EQ(sum.both, 80U);
  EXPECT_EQ(sum.either, 160U);
}

}  // namespace
}  // namespace ygslam
