#include "io/image_list.hpp"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "core/rng.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

std::vector<double> seconds_of(const ParsedList<ListedImage>& list) {
  std::vector<double> seconds;
  for (const ListedImage& image : list.entries) {
    seconds.push_back(static_cast<double>(image.stamp.ns) * 1e-9);
  }
  return seconds;
}

TEST(ImageList, ReadsStampsDecimalsAndPathsWithSpacesAndUtf8) {
  const auto list = parse_image_list(
      "\xEF\xBB\xBF# comment\r\n1.25 rgb/a b.png\r\n\r\n2.5\trgb/\xC3\xA4.png  \n3 x.png");
  ASSERT_EQ(list.entries.size(), 3U);
  EXPECT_EQ(list.entries[0].file, "rgb/a b.png");
  EXPECT_EQ(list.entries[0].decimals, 2);
  EXPECT_EQ(list.entries[1].file, "rgb/\xC3\xA4.png");
  EXPECT_EQ(list.entries[2].stamp.ns, 3'000'000'000);
  EXPECT_EQ(list.counts.left_out(), 0U);
}

TEST(ImageList, F11LinesInAnyOrderAreSortedAndDoublesCounted) {
  const auto list = parse_image_list("1 a\n2 b\n2 c\n1.5 d\n4 e\n3 f\n5 g\n");
  EXPECT_EQ(seconds_of(list), (std::vector<double>{1, 1.5, 2, 3, 4, 5}));
  EXPECT_EQ(list.entries[2].file, "b") << "of two the first";
  EXPECT_EQ(list.counts.doubled, 1U);
  EXPECT_EQ(list.counts.moved, 2U);
}

// Of a minute at 30 Hz, in the order that `place` gives.
ParsedList<ListedImage> list_in_order(const std::function<int(int)>& place) {
  constexpr int kLines = 1800;
  std::string text;
  for (int i = 0; i < kLines; ++i)
    text += format_stamp({1'000'000'000'000 + place(i) * std::int64_t{33'333'333}}, 6) + " " +
            std::to_string(place(i)) + ".png\n";
  return parse_image_list(text);
}

TEST(ImageList, NoOrderOfTheLinesLosesAFrame) {
  for (const auto& place : std::vector<std::function<int(int)>>{
           [](int i) { return 1799 - i; },                             // the last first
           [](int i) { return i * 707 % 1800; },                       // shuffled
           [](int i) { return i < 900 ? i + 900 : i - 900; },          // the second half first
           [](int i) { return i < 30 ? i + 1770 : i - 30; },           // its last second first
           [](int i) { return i % 2 == 0 ? i / 2 : 900 + i / 2; }}) {  // two lists line by line
    const auto list = list_in_order(place);
    ASSERT_EQ(list.entries.size(), 1800U);
    EXPECT_GT(list.counts.moved, 0U);
    for (int i = 0; i < 1800; ++i)
      ASSERT_EQ(list.entries[static_cast<std::size_t>(i)].file, std::to_string(i) + ".png");
  }
}

// 240 lines at 30 Hz; from line 81 on the clock is back by this.
ParsedList<ListedImage> list_set_back(double back_s, double offset_s = 0, int first_after = 80) {
  std::string text;
  for (int i = 0; i < 240; ++i)
    text += fmt::format("{:.6f} {}.png\n",
                        1000 + i / 30.0 + offset_s - (i < first_after ? 0 : back_s), i);
  return parse_image_list(text);
}

TEST(ImageList, AClockThatWasSetBackLosesNoFrameAndTimeGoesOn) {
  for (const double back_s : {500.0, 4.0, 1.0, 0.51}) {
    const auto list = list_set_back(back_s);
    ASSERT_EQ(list.entries.size(), 240U) << back_s;
    EXPECT_EQ(list.counts.left_out() + list.counts.moved, 0U);
    ASSERT_EQ(list.resets.size(), 1U);
    EXPECT_EQ(list.resets[0].place, 80U);
    EXPECT_NEAR(1e-9 * static_cast<double>(list.resets[0].back_ns), back_s - 1 / 30.0, 1e-5);
    for (int i = 0; i < 240; ++i) {
      EXPECT_EQ(list.entries[i].file, std::to_string(i) + ".png");
      EXPECT_NEAR(seconds_of(list)[i], 1000 + i / 30.0, 1e-5);
    }
  }
}

TEST(ImageList, ColourAndDepthOfAClockThatWasSetBackAreShiftedAlike) {
  auto colour = list_set_back(500);
  auto depth = list_set_back(500, 0.012, 83);  // three images later
  ASSERT_TRUE(align_resets(colour, depth));
  ASSERT_EQ(depth.resets[0].shift_ns, colour.resets[0].shift_ns);
  for (std::size_t i = 0; i < 240; ++i) {
    const bool between = i >= 80 && i < 83;
    if (between) continue;
    EXPECT_NEAR(seconds_of(depth)[i] - seconds_of(colour)[i], 0.012, 1e-5) << i;
  }
  for (const auto* list : {&colour, &depth})
    for (std::size_t i = 1; i < 240; ++i)
      ASSERT_GT(list->entries[i].stamp, list->entries[i - 1].stamp) << i;
  auto never = list_set_back(0);
  EXPECT_FALSE(align_resets(colour, never));
}

TEST(ImageList, F11AFirstStampAnHourAheadIsLeftOut) {
  std::string text = "4600.0 a.png\n";
  for (int i = 0; i < 50; ++i) text += std::to_string(1000 + i) + " x.png\n";
  const auto list = parse_image_list(text);
  EXPECT_EQ(list.entries.size(), 50U);
  EXPECT_EQ(list.counts.jumped, 1U);
}

TEST(ImageList, F11CountsNegativeNanAndTextStamps) {
  const auto list = parse_image_list("1 a\n-2 b\nnan c\nxyz d\n3\n4 e\n");
  EXPECT_EQ(seconds_of(list), (std::vector<double>{1, 4}));
  EXPECT_EQ(list.counts.negative, 1U);
  EXPECT_EQ(list.counts.malformed, 3U);
  EXPECT_EQ(list.first_fault, "2: '-2 b'");
}

TEST(ImageList, F11OneStampAnHourAheadDoesNotDropAllThatFollow) {
  std::string text;
  for (int i = 0; i < 50; ++i) text += std::to_string(i + (i == 20 ? 3600 : 0)) + " x.png\n";
  const auto list = parse_image_list(text);
  EXPECT_EQ(list.entries.size(), 49U);
  EXPECT_EQ(list.counts.jumped, 1U);
  EXPECT_EQ(list.counts.doubled, 0U);
}

TEST(ImageList, F11OneStampAnHourBackIsLeftOut) {
  std::string text;
  for (int i = 0; i < 50; ++i) text += std::to_string(5000 + i - (i == 20 ? 3600 : 0)) + " x.png\n";
  const auto list = parse_image_list(text);
  EXPECT_EQ(list.entries.size(), 49U);
  EXPECT_EQ(list.counts.jumped, 1U);
  EXPECT_EQ(list.entries.front().stamp.ns, 5'000'000'000'000);
}

TEST(ImageList, F11AClockThatStaysAnHourAheadIsAGapOnly) {
  std::string text;
  for (int i = 0; i < 50; ++i) text += std::to_string(i + (i >= 20 ? 3600 : 0)) + " x.png\n";
  EXPECT_EQ(parse_image_list(text).entries.size(), 50U);
}

TEST(ImageList, F11ShuffledStampsStayStrictlyIncreasing) {
  Rng rng(2);
  for (int round = 0; round < 200; ++round) {
    std::string text;
    for (int i = 0; i < 40; ++i) {
      text += std::to_string(static_cast<int>(rng.below(60)) - 3) + " x.png\n";
    }
    const auto list = parse_image_list(text);
    ASSERT_FALSE(list.entries.empty());
    for (std::size_t i = 1; i < list.entries.size(); ++i) {
      ASSERT_LT(list.entries[i - 1].stamp, list.entries[i].stamp);
    }
    EXPECT_EQ(list.entries.size() + list.counts.left_out(), list.counts.lines);
  }
}

TEST(ImageList, F31PathsOutsideTheFolderAreRefusedAndCounted) {
  const auto list = parse_image_list(
      "1 ../secret.png\n2 rgb/../../x.png\n3 /etc/passwd\n4 rgb/..\n5 rgb/..a.png\n6 ..\n");
  ASSERT_EQ(list.entries.size(), 1U);
  EXPECT_EQ(list.entries[0].file, "rgb/..a.png");
  EXPECT_EQ(list.counts.refused, 5U);
  EXPECT_FALSE(is_inside(std::string_view("a\0b", 3)));
  EXPECT_FALSE(is_inside(""));
}

TEST(Associations, ReadsBothOrdersAndPathsWithSpaces) {
  const auto list = parse_associations(
      "1.0 rgb/a.png 1.01 depth/a.png\n2.0 depth/b.png 2.01 rgb/b.png\n"
      "3.0 rgb/my file.png 3.1 depth/my file.png\n");
  ASSERT_EQ(list.entries.size(), 3U);
  EXPECT_EQ(list.entries[0].depth.file, "depth/a.png");
  EXPECT_EQ(list.entries[1].colour.file, "rgb/b.png");
  EXPECT_EQ(list.entries[1].colour.stamp.ns, 2'010'000'000);
  EXPECT_EQ(list.entries[2].colour.file, "rgb/my file.png");
  EXPECT_EQ(list.entries[2].depth.stamp.ns, 3'100'000'000);
}

TEST(Associations, F11LinesWithoutTwoStampsAndPathsAreMalformed) {
  const auto list = parse_associations(
      "1 rgb/a.png\n2 rgb/b.png nan depth/b.png\n3 rgb/c.png 3\nnan rgb/d.png 4 depth/d.png\n"
      "5 rgb/e.png 5 depth/e.png\n6 ../f.png 6 depth/f.png\n");
  ASSERT_EQ(list.entries.size(), 1U);
  EXPECT_EQ(list.counts.malformed, 4U);
  EXPECT_EQ(list.counts.refused, 1U);
}

}  // namespace
}  // namespace ygslam
