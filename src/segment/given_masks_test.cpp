#include "segment/given_masks.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

SegmentationPtr masks_of(std::uint32_t frame) {
  auto masks = std::make_shared<Segmentation>();
  masks->frame = FrameId{frame};
  return masks;
}

TEST(GivenMasks, EachGoesToItsFrameAndNoneToAFrameWithout) {
  GivenMasks given;
  given.put(masks_of(1));
  given.put(masks_of(3));
  EXPECT_EQ(given.take(FrameId{0}), nullptr);
  EXPECT_EQ(given.take(FrameId{1})->frame, FrameId{1});
  EXPECT_EQ(given.take(FrameId{1}), nullptr);
  EXPECT_EQ(given.take(FrameId{2}), nullptr);
  EXPECT_EQ(given.take(FrameId{3})->frame, FrameId{3});
}

TEST(GivenMasks, ThoseOfFramesThatNeverCameAreLetGo) {
  auto given = std::make_shared<GivenMasks>();
  for (std::uint32_t i = 0; i < 100; ++i) given->put(masks_of(i));
  const auto segmenter = make_given_segmenter(given);
  RgbdFrame frame;
  frame.id = FrameId{3};
  EXPECT_FALSE(segmenter->segment(frame).ok());
  frame.id = FrameId{99};
  EXPECT_TRUE(segmenter->segment(frame).ok());
  EXPECT_TRUE(segmenter->in_step());
}

}  // namespace
}  // namespace ygslam
