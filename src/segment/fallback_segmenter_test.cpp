#include "segment/fallback_segmenter.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace ygslam {
namespace {

/// Takes so long for a mask, which has as many instances as its id says.
class Paced final : public Segmenter {
 public:
  Paced(std::size_t id, int ms, bool in_step) : id_(id), ms_(ms), in_step_(in_step) {}
  Result<Segmentation> segment(const RgbdFrame& frame) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(frame.id == FrameId{3} ? 0 : ms_));
    Segmentation masks;
    masks.instances.resize(id_);
    return masks;
  }
  [[nodiscard]] std::string precision() const override { return "test"; }
  [[nodiscard]] bool in_step() const override { return in_step_; }

 private:
  std::size_t id_;
  int ms_;
  bool in_step_;
};

RgbdFrame frame_of(std::uint32_t id) {
  RgbdFrame frame;
  frame.id = FrameId{id};
  return frame;
}

TEST(FallbackSegmenter, HandsOverAfterMasksThatWereLateInARow) {
  int made = 0;
  const auto segmenter = make_fallback_segmenter(
      std::make_unique<Paced>(1, 4, false),
      [&]() -> Result<std::unique_ptr<Segmenter>> {
        ++made;
        return std::unique_ptr<Segmenter>(std::make_unique<Paced>(2, 4, true));
      },
      {.late_s = 0.002, .late_masks = 4});
  // 3 is in time: 4, 5, 6 and 7 are the first four in a row.
  for (std::uint32_t id = 0; id < 12; ++id) {
    const bool is_second = id > 7;
    EXPECT_EQ(segmenter->in_step(), is_second) << id;
    const auto masks = segmenter->segment(frame_of(id));
    ASSERT_TRUE(masks.ok());
    EXPECT_EQ(masks->instances.size(), is_second ? 2U : 1U) << id;
    EXPECT_EQ(masks->by_fallback, is_second) << id;
  }
  EXPECT_EQ(made, 1) << "the second may be late";
}

TEST(FallbackSegmenter, StaysWithTheFirstWhereThereIsNoSecond) {
  int asked = 0;
  const auto segmenter =
      make_fallback_segmenter(std::make_unique<Paced>(1, 4, false),
                              [&]() -> Result<std::unique_ptr<Segmenter>> {
                                ++asked;
                                return Error{ErrorKind::kModel, "built without weights"};
                              },
                              {.late_s = 0.002, .late_masks = 2});
  for (std::uint32_t id = 10; id < 16; ++id) {
    const auto masks = segmenter->segment(frame_of(id));
    ASSERT_TRUE(masks.ok());
    EXPECT_EQ(masks->instances.size(), 1U);
    EXPECT_FALSE(masks->by_fallback);
  }
  EXPECT_EQ(asked, 1);
}

}  // namespace
}  // namespace ygslam
