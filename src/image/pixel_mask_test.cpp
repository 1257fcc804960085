#include "image/pixel_mask.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

PixelMaskPtr box(int u0, int v0, int u1, int v1) {
  auto mask = std::make_shared<GreyImage>(60, 30);
  for (int v = v0; v < v1; ++v)
    for (int u = u0; u < u1; ++u) mask->at(u, v) = 255;
  return mask;
}

TEST(PixelMask, TwoAreJoinedAndEachIsCoveredByBoth) {
  const auto a = box(0, 0, 10, 10), b = box(5, 5, 20, 20);
  const auto both = joined(a, b);
  EXPECT_FALSE(covers_more(a, both));
  EXPECT_FALSE(covers_more(b, both));
  EXPECT_TRUE(covers_more(both, a));
  EXPECT_NEAR(covered_share(both), (100 + 225 - 25) / 1800.0, 1e-12);
  EXPECT_EQ(joined(nullptr, b), b);
  EXPECT_EQ(joined(a, nullptr), a);
  EXPECT_FALSE(joined(nullptr, nullptr));
  EXPECT_TRUE(covers_more(a, nullptr));
  EXPECT_FALSE(covers_more(box(0, 0, 0, 0), nullptr)) << "one that covers nothing";
}

TEST(PixelMask, ItsPlaceIsToldInWords) {
  EXPECT_EQ(place_in_image(*box(0, 24, 60, 30)), "lower edge");
  EXPECT_EQ(place_in_image(*box(0, 0, 15, 5)), "upper left");
  EXPECT_EQ(place_in_image(*box(45, 0, 60, 30)), "right edge");
  EXPECT_EQ(place_in_image(*box(25, 12, 35, 18)), "centre");
  EXPECT_EQ(place_in_image(*box(0, 0, 60, 30)), "all over");
}

TEST(PixelMask, DepthIsTakenOutAndTheFrameOfOthersStays) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->depth_m = DepthImage(60, 30, 2.0F);
  const auto masked = without_masked_depth(frame, box(0, 0, 10, 10));
  EXPECT_EQ(masked->depth_m.at(3, 3), 0.0F);
  EXPECT_EQ(masked->depth_m.at(20, 3), 2.0F);
  EXPECT_EQ(frame->depth_m.at(3, 3), 2.0F);
  EXPECT_EQ(without_masked_depth(frame, nullptr), frame);
}

}  // namespace
}  // namespace ygslam
