#include "eval/tracking_score.hpp"

#include <gtest/gtest.h>

#include "eval/mot_text.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

const PixelBox kLeft{0, 0, 10, 20}, kRight{50, 0, 60, 20};

std::vector<SimilarityFrame> compared(const std::vector<BoxFrame>& frames) {
  std::vector<SimilarityFrame> result;
  for (const BoxFrame& frame : frames) result.push_back(compare(frame));
  return result;
}

TEST(TrackingScore, ExactTracksAreWorthOne) {
  std::vector<BoxFrame> frames(5);
  for (BoxFrame& frame : frames) frame = {{{1, kLeft}, {2, kRight}}, {{7, kRight}, {9, kLeft}}};
  const TrackingScore score = score_tracking(compared(frames));
  for (const double value : {score.hota, score.det_a, score.ass_a, score.idf1, score.mota})
    EXPECT_DOUBLE_EQ(value, 1);
  EXPECT_EQ(score.found, 10U);
  EXPECT_EQ(score.id_switches, 0U);
}

/// Four frames, the id changes in the middle; by the papers' formulas on paper.
TEST(TrackingScore, ABrokenTrackLosesAssociationButNoDetection) {
  std::vector<BoxFrame> frames(4);
  for (int k = 0; k < 4; ++k) frames[k] = {{{1, kLeft}}, {{k < 2 ? 7 : 8, kLeft}}};
  const TrackingScore score = score_tracking(compared(frames));
  EXPECT_DOUBLE_EQ(score.det_a, 1);
  EXPECT_DOUBLE_EQ(score.ass_a, 0.5);  // each of the four: 2 common of 4
  EXPECT_DOUBLE_EQ(score.hota, std::sqrt(0.5));
  EXPECT_DOUBLE_EQ(score.idf1, 0.5);  // IDTP 2, IDFP 2, IDFN 2
  EXPECT_EQ(score.id_switches, 1U);
  EXPECT_EQ(score.switches.at(1), 1U);
  EXPECT_DOUBLE_EQ(score.mota, 0.75);
  EXPECT_EQ(score.tracked_frames.size(), 2U);
}

TEST(TrackingScore, MissesAndFalseAlarmsCount) {
  std::vector<BoxFrame> frames(4, {{{1, kLeft}}, {{7, kLeft}}});
  frames[0].tracked.clear();
  frames[1].tracked.push_back({8, kRight});
  const TrackingScore score = score_tracking(compared(frames));
  EXPECT_EQ(score.missed, 1U);
  EXPECT_EQ(score.false_alarms, 1U);
  EXPECT_EQ(score.false_frames.at(8), 1U);
  EXPECT_EQ(score.false_frames.at(7), 0U);
  EXPECT_DOUBLE_EQ(score.mota, 0.5);
  EXPECT_DOUBLE_EQ(score.det_a, 3.0 / 5);
  EXPECT_DOUBLE_EQ(score.id_recall, 3.0 / 4);
  EXPECT_DOUBLE_EQ(score.id_precision, 3.0 / 4);
}

TEST(TrackingScore, WhatDoesNotCountMayBeFoundOrNot) {
  BoxFrame frame{{{1, kLeft, false}, {2, kRight}}, {{7, kLeft}, {8, kRight}}};
  const SimilarityFrame compared_frame = compare(frame);
  EXPECT_EQ(compared_frame.truth, std::vector<int>{2});
  EXPECT_EQ(compared_frame.tracked, std::vector<int>{8});
  frame.tracked.erase(frame.tracked.begin());
  EXPECT_DOUBLE_EQ(score_tracking(std::vector{compare(frame)}).hota, 1);
}

TEST(TrackingScore, APartOfWhatDoesNotCountIsNoFalseAlarm) {
  const PixelBox part{0, 0, 5, 8};
  EXPECT_TRUE(compare({{{1, kLeft, false}}, {{7, part}}}).tracked.empty());
  EXPECT_EQ(compare({{{1, kLeft}}, {{7, part}}}).tracked.size(), 1U);
  // What shows a thing that counts is that thing's.
  EXPECT_EQ(compare({{{1, kLeft, false}, {2, part}}, {{7, part}}}).tracked.size(), 1U);
}

TEST(TrackingScore, NothingTrackedOrNothingThere) {
  EXPECT_EQ(score_tracking({}).hota, 0);
  EXPECT_EQ(score_tracking(compared({{{{1, kLeft}}, {}}})).missed, 1U);
  EXPECT_EQ(score_tracking(compared({{{}, {{1, kLeft}}}})).false_alarms, 1U);
}

TEST(MotText, ComesBackAsWritten) {
  const std::vector<BoxFrame> frames{
      {{{1, kLeft}}, {{7, kLeft}}}, {}, {{{1, kLeft, false}, {2, kRight}}, {{7, kRight}}}};
  const testing::TempFolder folder;
  testing::write(folder.path() / "truth.txt", mot_text(frames, &BoxFrame::truth));
  testing::write(folder.path() / "tracks.txt", mot_text(frames, &BoxFrame::tracked));
  const auto read = read_mot(folder.path() / "truth.txt", folder.path() / "tracks.txt");
  ASSERT_TRUE(read.ok());
  ASSERT_EQ(read->size(), 3U);
  EXPECT_EQ(mot_text(*read, &BoxFrame::truth), mot_text(frames, &BoxFrame::truth));
  EXPECT_EQ(mot_text(*read, &BoxFrame::tracked), mot_text(frames, &BoxFrame::tracked));
}

TEST(MotText, FaultsNameTheLine) {
  const testing::TempFolder folder;
  testing::write(folder.path() / "good.txt", "1,1,0,0,5,5\n");
  for (const char* text : {"0,1,0,0,5,5\n", "1,1.5,0,0,5,5\n", "1,1,0,0,5\n", "1,1,0,0,5,nan\n",
                           "1,1,0,0,5,5\n1,1,3,3,5,5\n", "1e12,1,0,0,5,5\n"}) {
    testing::write(folder.path() / "bad.txt", text);
    const auto read = read_mot(folder.path() / "good.txt", folder.path() / "bad.txt");
    ASSERT_FALSE(read.ok()) << text;
    EXPECT_NE(read.error().message.find("bad.txt:"), std::string::npos) << read.error().message;
  }
}

}  // namespace
}  // namespace ygslam
