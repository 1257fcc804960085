#include "dense/round_objects.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

/// A wall at 2 m, and an upright cylinder before it: 20 pixels wide, 0.3 m at 1.5 m.
class RoundObjects : public ::testing::Test {
 protected:
  RoundObjects() {
    view_.camera = {100, 100, 31.5, 23.5, 64, 48};
    view_.depth = Image<std::uint16_t>(64, 48);
    view_.colour = ColourImage(64, 48);
    view_.object = Image<std::uint8_t>(64, 48);
    view_.objects = {SceneObjectId{1}};
    for (int v = 0; v < 48; ++v) {
      for (int u = 0; u < 64; ++u) set_depth(u, v, is_cylinder(u, v) ? cylinder_m(u) : 2.0);
    }
  }
  static bool is_cylinder(int u, int v) { return u >= 20 && u < 40 && v >= 8 && v < 40; }
  static double cylinder_m(int u) {
    const double aside_m = (u - 29.5) / 100 * 1.5;
    return 1.5 + 0.15 - std::sqrt(0.15 * 0.15 - aside_m * aside_m);
  }
  void set_depth(int u, int v, double depth_m) {
    view_.depth.at(u, v) = static_cast<std::uint16_t>(depth_m / DepthView::kUnit_m);
  }
  void mark(int left, int top, int right, int bottom) {
    for (int v = top; v < bottom; ++v)
      for (int u = left; u < right; ++u) view_.object.at(u, v) = kIt;
  }
  void drop_beyond(int coco) {
    const std::vector<Detection> detections = {{coco_class(coco), 0.5F}};
    drop_beyond_round_objects(view_, detections, {});
  }
  [[nodiscard]] int count(std::uint8_t object) const {
    return static_cast<int>(std::count(view_.object.begin(), view_.object.end(), object));
  }

  static constexpr std::uint8_t kIt = 1;
  static constexpr int kBottle = 39;
  DepthView view_;
};

TEST_F(RoundObjects, AllThatIsSeenOfItStays) {
  mark(20, 8, 40, 40);
  drop_beyond(kBottle);
  EXPECT_EQ(count(kIt), 20 * 32);
}

TEST_F(RoundObjects, WhatStandsBeforeItAndBehindIsNoneOfIt) {
  for (int v = 30; v < 40; ++v)
    for (int u = 16; u < 24; ++u) set_depth(u, v, 1.35);  // a toy
  mark(16, 4, 40, 40);                                    // its mask reaches up and left
  drop_beyond(kBottle);
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const bool is_toy = u >= 16 && u < 24 && v >= 30 && v < 40;
      ASSERT_EQ(view_.object.at(u, v) == kIt, is_cylinder(u, v) && !is_toy) << u << ' ' << v;
    }
  }
  EXPECT_EQ(count(DepthView::kUnsure), 24 * 36 - count(kIt)) << "the mask or the depth is wrong";
}

TEST_F(RoundObjects, PixelsWithoutDepthStay) {
  for (int v = 8; v < 20; ++v)
    for (int u = 20; u < 40; ++u) set_depth(u, v, 0);  // glass
  mark(20, 8, 40, 40);
  drop_beyond(kBottle);
  EXPECT_EQ(count(kIt), 20 * 32);
}

TEST_F(RoundObjects, OfOthersNothingIsKnown) {
  mark(16, 4, 44, 44);
  for (const int coco : {56, 58}) drop_beyond(coco);  // a chair, a plant with leaves
  EXPECT_EQ(count(kIt), 28 * 40);
  EXPECT_TRUE(is_round(coco_class(58)));
  EXPECT_FALSE(is_round(coco_class(60)));
  EXPECT_FALSE(is_round(SemanticClass::kUnknown));
}

}  // namespace
}  // namespace ygslam
