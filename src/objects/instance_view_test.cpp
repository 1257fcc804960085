#include "objects/instance_view.hpp"

#include <gtest/gtest.h>

#include "objects/testing/board_scene.hpp"

namespace ygslam {
namespace {

using testing::kPerson;
using testing::small_camera;

struct Shown {
  PixelBox box;
  float score;
  float depth_m;
};

/// A mask of upright boxes, best score first as a network paints them.
std::vector<InstanceView> view(const std::vector<Shown>& shown) {
  RgbdFrame frame;
  frame.depth_m = DepthImage(320, 240, 6.0F);
  frame.colour = ColourImage(320, 240);
  Segmentation masks;
  masks.ids = GreyImage(320, 240);
  for (const Shown& s : shown) {
    masks.instances.push_back({kPerson, s.score, s.box.x0, s.box.y0, s.box.x1, s.box.y1});
    for (int v = static_cast<int>(s.box.y0); v < static_cast<int>(s.box.y1); ++v) {
      for (int u = static_cast<int>(s.box.x0); u < static_cast<int>(s.box.x1); ++u) {
        if (masks.ids.at(u, v) != 0) continue;
        masks.ids.at(u, v) = static_cast<std::uint8_t>(masks.instances.size());
        frame.depth_m.at(u, v) = s.depth_m;
      }
    }
  }
  const Camera camera = small_camera();
  return view_instances(masks, make_thumbnail(frame), camera, SE3(), MovableClasses());
}

TEST(InstanceView, HasBoxDepthAndPlace) {
  const auto seen = view({{{100, 40, 180, 200}, 0.9F, 2}});
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].box.x1, 180);
  EXPECT_FLOAT_EQ(seen[0].depth_m, 2);
  EXPECT_NEAR(seen[0].centre_odom.x(), (140 - 160) / 250.0 * 2, 0.05);
  EXPECT_NEAR(seen[0].max_odom.y() - seen[0].min_odom.y(), 0.9 * 160 / 250.0 * 2, 0.12);
}

TEST(InstanceView, AHeadFoundOnceMoreIsPartOfThePerson) {
  const auto seen = view({{{100, 40, 180, 200}, 0.9F, 2}, {{120, 20, 160, 80}, 0.5F, 2}});
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].ids.size(), 2U);
  EXPECT_EQ(seen[0].box.y0, 20);
}

TEST(InstanceView, SomeoneBehindIsSomeoneElse) {
  EXPECT_EQ(view({{{100, 40, 180, 200}, 0.9F, 2}, {{130, 40, 220, 200}, 0.5F, 3}}).size(), 2U);
  // At the same depth no second body fits in so much of the same place.
  EXPECT_EQ(view({{{100, 40, 180, 200}, 0.9F, 2}, {{130, 40, 220, 200}, 0.5F, 2.1F}}).size(), 1U);
}

TEST(InstanceView, WhatABetterMaskLeftOverOfABoxIsNoBody) {
  EXPECT_EQ(view({{{100, 40, 180, 200}, 0.9F, 2}, {{96, 40, 184, 204}, 0.5F, 5}}).size(), 1U);
}

TEST(InstanceView, ABoxAboutTwoPersonsIsNoThird) {
  const auto seen = view({{{80, 40, 150, 200}, 0.9F, 2},
                          {{160, 40, 230, 200}, 0.8F, 2},
                          {{80, 40, 230, 210}, 0.4F, 2}});
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].box.x1, 150);
  EXPECT_EQ(seen[1].box.x0, 160);
}

TEST(Appearance, KnowsColoursByHalves) {
  Appearance red_over_blue, red_over_green, other;
  for (int i = 0; i < 10; ++i) {
    red_over_blue.add({200, 0, 0}, false), red_over_blue.add({0, 0, 200}, true);
    red_over_green.add({200, 0, 0}, false), red_over_green.add({0, 200, 0}, true);
    other.add({0, 0, 200}, false), other.add({200, 0, 0}, true);
  }
  for (Appearance* appearance : {&red_over_blue, &red_over_green, &other}) appearance->normalise();
  EXPECT_NEAR(red_over_blue.similarity(red_over_blue), 1, 1e-6);
  EXPECT_NEAR(red_over_blue.similarity(red_over_green), 0.5, 1e-6);
  EXPECT_NEAR(red_over_blue.similarity(other), 0, 1e-6);
  red_over_blue.blend(red_over_green, 1);
  EXPECT_NEAR(red_over_blue.similarity(red_over_green), 1, 1e-6);
}

}  // namespace
}  // namespace ygslam
