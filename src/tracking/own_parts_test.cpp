// What of a network's masks lies on the camera's own parts.
#include "tracking/own_parts.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace ygslam {
namespace {

constexpr int kWidth_px = 64, kHeight_px = 48;

/// The lowest 8 rows.
PixelMaskPtr bonnet() {
  auto mask = std::make_shared<GreyImage>(kWidth_px, kHeight_px);
  for (int v = 40; v < kHeight_px; ++v) std::fill_n(mask->row(v), kWidth_px, 255);
  return mask;
}

/// Two instances: columns 0 to 9 of the rows from `first_v` on, and a person beside them who stands
/// behind the bonnet.
SegmentationPtr masks_of(int first_v) {
  auto masks = std::make_shared<Segmentation>();
  masks->instances = {{.class_id = 0, .score = 0.6F}, {.class_id = 0, .score = 0.9F}};
  masks->ids = GreyImage(kWidth_px, kHeight_px);
  for (int v = first_v; v < kHeight_px; ++v) std::fill_n(masks->ids.row(v), 10, 1);
  for (int v = 10; v < kHeight_px; ++v) std::fill_n(masks->ids.row(v) + 20, 10, 2);
  return masks;
}

TEST(OwnParts, AnInstanceOnTheBonnetIsDroppedAndTheOthersAreNumberedAnew) {
  const auto kept = without_own_parts(masks_of(38), bonnet());
  ASSERT_EQ(kept->instances.size(), 1U);
  EXPECT_EQ(kept->instances[0].score, 0.9F);
  EXPECT_EQ(kept->ids.at(5, 45), 0);
  EXPECT_EQ(kept->ids.at(25, 45), 1);
  EXPECT_EQ(kept->ids.at(25, 15), 1);
}

TEST(OwnParts, WhoeverStandsBehindTheBonnetStays) {
  const auto masks = masks_of(20);
  EXPECT_EQ(without_own_parts(masks, bonnet()), masks);
  EXPECT_EQ(without_own_parts(masks, nullptr), masks);
  EXPECT_EQ(without_own_parts(nullptr, bonnet()), nullptr);
}

TEST(OwnParts, MasksMayBeSmallerThanTheImage) {
  auto image = std::make_shared<GreyImage>(2 * kWidth_px, 2 * kHeight_px);
  for (int v = 80; v < image->height(); ++v) std::fill_n(image->row(v), image->width(), 255);
  EXPECT_EQ(without_own_parts(masks_of(38), image)->instances.size(), 1U);
}

}  // namespace
}  // namespace ygslam
