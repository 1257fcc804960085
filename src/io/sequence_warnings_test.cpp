#include "io/sequence_warnings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "io/testing/small_sequence.hpp"
#include "io/tum_sequence.hpp"

namespace ygslam {
namespace {

using testing::SmallSequence;
using testing::TempFolder;
using testing::warns_of;

TEST(SequenceWarnings, F12AnOffsetOf50MsIsReportedWithItsSize) {
  const TempFolder folder;
  SmallSequence{.count = 40, .depth_offset_ns = 50'000'000}.write_to(folder.path());
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  EXPECT_TRUE(warns_of(*sequence, "offset by 50 ms")) << sequence->warnings.size();
}

TEST(SequenceWarnings, F12ADepthClockOfItsOwnIsNoOffset) {
  const TempFolder folder;
  SmallSequence{.count = 300,
                .width = 4,
                .height = 4,
                .depth_offset_ns = 14'000'000,
                .depth_rate = 1.005,
                .calibration = "fx 4\nfy 4\ncx 2\ncy 2\n"}
      .write_to(folder.path());
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok()) << sequence.error().message;
  EXPECT_GT(sequence->pairs.size(), 280U);
  EXPECT_TRUE(sequence->warnings.empty()) << sequence->warnings.front();
  EXPECT_EQ(sequence->without_depth, 300 - sequence->pairs.size());
}

/// A small sequence whose stamps are moved, or scaled.
Result<Sequence> with_stamps(const std::function<std::int64_t(std::int64_t ns, int line)>& change) {
  const TempFolder folder;
  const SmallSequence small{.count = 12, .associations = true};
  small.write_to(folder.path());
  std::string text;
  int line_number = 0;
  const std::string as_recorded = testing::read(folder.path() / "associations.txt");
  for (const TextLine& line : data_lines(as_recorded)) {
    for (const std::string_view word : words_of(line.text)) {
      const auto stamp = parse_stamp(word);
      text +=
          (stamp ? format_stamp({change(stamp->stamp.ns, line_number)}, 6) : std::string(word)) +
          " ";
    }
    text += "\n";
    ++line_number;
  }
  testing::write(folder.path() / "associations.txt", text);
  return open_tum_sequence(folder.path());
}

TEST(SequenceWarnings, StampsOfAnotherUnitAreToldOnce) {
  const auto ms = with_stamps([](std::int64_t ns, int) { return ns * 1000; });
  ASSERT_TRUE(ms.ok()) << ms.error().message;
  EXPECT_TRUE(warns_of(*ms, "s apart; are these stamps milliseconds? They are taken as seconds"));
  const auto s = with_stamps([](std::int64_t ns, int) { return ns; });
  EXPECT_FALSE(warns_of(*s, "apart"));
}

TEST(SequenceWarnings, GapsOfOverAMinuteAreToldOnce) {
  const auto gaps = with_stamps([](std::int64_t ns, int line) {
    return ns + (line >= 4 ? 90'000'000'000 : 0) + (line >= 8 ? 3'600'000'000'000 : 0);
  });
  ASSERT_TRUE(gaps.ok()) << gaps.error().message;
  EXPECT_TRUE(warns_of(*gaps, "2 gaps of over a minute between frames, the longest 3600 s after"));
  EXPECT_EQ(gaps->warnings.size(), 1U);
}

TEST(SequenceWarnings, APrincipalPointFarFromTheMiddleIsTold) {
  const TempFolder folder;
  const SmallSequence small{.count = 3, .associations = true};
  small.write_to(folder.path());
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok());
  CameraConfig camera = sequence->camera;
  camera.cx = 0.85 * camera.width;
  const auto off = open_tum_sequence(folder.path(), {.colour = camera});
  ASSERT_TRUE(off.ok()) << off.error().message;
  EXPECT_TRUE(warns_of(*off, "lies far from the middle of images of"));
  EXPECT_FALSE(warns_of(*sequence, "lies far from the middle"));
}

TEST(SequenceWarnings, APrincipalPointOfAnotherImageIsTold) {
  const TempFolder folder;
  const SmallSequence small{.count = 3, .associations = true};
  small.write_to(folder.path());
  const auto sequence = open_tum_sequence(folder.path());
  ASSERT_TRUE(sequence.ok());
  const auto told = [&](double cx, double cy, const std::string& words) {
    CameraConfig camera = sequence->camera;
    camera.cx = cx * camera.width;
    camera.cy = cy * camera.height;
    const auto other = open_tum_sequence(folder.path(), {.colour = camera});
    return other.ok() && warns_of(*other, words);
  };
  EXPECT_TRUE(told(0.25, 0.26, "is this the camera of images of another size?"));
  EXPECT_TRUE(told(0.37, 0.38, "is this the camera of images of another size?"));
  EXPECT_FALSE(told(0.45, 0.44, "principal point"));
  EXPECT_FALSE(told(0.37, 0.55, "principal point"));
  const double aspect = static_cast<double>(sequence->camera.width) / sequence->camera.height;
  EXPECT_TRUE(told(0.51 / aspect, 0.49 * aspect, "are cx and cy swapped?"));
}

TEST(SequenceWarnings, StampsFasterThanCamerasAreTold) {
  const auto fast = with_stamps([](std::int64_t ns, int /*line*/) { return ns / 1000; });
  ASSERT_TRUE(fast.ok()) << fast.error().message;
  EXPECT_TRUE(warns_of(*fast, "faster than cameras are: are these stamps of another unit?"));
}

}  // namespace
}  // namespace ygslam
