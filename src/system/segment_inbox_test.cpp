#include "system/segment_inbox.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace ygslam {
namespace {

FramePtr frame(std::uint32_t id) {
  auto f = std::make_shared<RgbdFrame>();
  f->id = FrameId{id};
  return f;
}

std::uint32_t take(SegmentInbox& inbox) { return index(inbox.take({})->id); }

TEST(SegmentInbox, NewestFrameWins) {
  SegmentInbox inbox;
  for (std::uint32_t i = 0; i < 5; ++i) inbox.put_frame(frame(i));
  EXPECT_EQ(take(inbox), 4U);
}

TEST(SegmentInbox, KeyframesComeFirstInOrder) {
  SegmentInbox inbox;
  inbox.put_frame(frame(1));
  inbox.put_keyframe(frame(1));
  inbox.put_frame(frame(2));
  inbox.put_frame(frame(3));
  inbox.put_keyframe(frame(3));
  inbox.put_frame(frame(4));
  EXPECT_EQ(take(inbox), 1U);
  EXPECT_EQ(take(inbox), 3U);
  EXPECT_EQ(take(inbox), 4U);
}

TEST(SegmentInbox, AFrameThatBecomesAKeyframeIsSegmentedOnce) {
  SegmentInbox inbox;
  inbox.put_frame(frame(7));
  inbox.put_keyframe(frame(7));
  EXPECT_EQ(take(inbox), 7U);
  inbox.put_frame(frame(8));
  EXPECT_EQ(take(inbox), 8U) << "7 is done";
  inbox.put_keyframe(frame(8));  // it was taken just before it became a keyframe
  inbox.put_frame(frame(9));
  EXPECT_EQ(take(inbox), 9U);
}

TEST(SegmentInbox, TooManyKeyframesLoseTheOldest) {
  SegmentInbox inbox;
  for (std::uint32_t i = 0; i < 10; ++i) inbox.put_keyframe(frame(i));
  std::vector<std::uint32_t> taken;
  inbox.put_frame(frame(100));
  while (taken.empty() || taken.back() != 100) taken.push_back(take(inbox));
  EXPECT_EQ(taken, (std::vector<std::uint32_t>{6, 7, 8, 9, 100}));
}

TEST(SegmentInbox, AStopTokenFreesTheReader) {
  SegmentInbox inbox;
  FramePtr taken = frame(1);
  {
    std::jthread reader([&](const std::stop_token& stop) { taken = inbox.take(stop); });
    reader.request_stop();
  }
  EXPECT_EQ(taken, nullptr);
}

TEST(SegmentInbox, BetweenThreadsFramesOnlyGetNewerAndTheLastArrives) {
  SegmentInbox inbox;
  std::vector<std::uint32_t> taken;
  {
    const std::jthread writer([&] {
      for (std::uint32_t i = 1; i <= 2000; ++i) inbox.put_frame(frame(i));
    });
    while (taken.empty() || taken.back() != 2000) taken.push_back(take(inbox));
  }
  EXPECT_TRUE(std::is_sorted(taken.begin(), taken.end()));
}

}  // namespace
}  // namespace ygslam
