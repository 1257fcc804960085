#include "eval/change_score.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace ygslam {
namespace {

constexpr Timestamp at(double seconds) { return {static_cast<std::int64_t>(seconds * 1e9)}; }

UprightBox box(double x) { return {{x, 0, 0.5}, {0.5, 0.5, 1}, 0}; }

/// A chair that goes from 0 to 2 between 5 and 7 s, and a table that stays.
std::vector<TrueThing> truth() {
  return {{"chair", false, {{box(0), at(0), at(5), 50}, {box(2), at(7), at(20), 50}}},
          {"dining table", false, {{box(5), at(0), at(20), 50}}},
          {"book", true, {{box(8), at(0), at(20), 50}}}};
}

TEST(ChangeScore, OfAMapThatFollowed) {
  const std::vector<MappedThing> found = {
      {"chair", {{box(0), at(1), at(8)}, {box(2), at(9.5), {}}}},
      {"dining table", {{box(5), at(1), {}}}}};
  const ChangeScore score = score_changes(found, truth());
  EXPECT_EQ(score.left, 1);
  EXPECT_EQ(score.freed, 1);
  EXPECT_EQ(score.taken, 1);
  EXPECT_EQ(score.known, 1);
  EXPECT_EQ(score.same_number, 1);
  EXPECT_EQ(score.stayed, 1);
  EXPECT_EQ(score.lost, 0);
  ASSERT_EQ(score.freed_after_s.size(), 1U);
  EXPECT_DOUBLE_EQ(score.freed_after_s[0], 3);
  ASSERT_EQ(score.known_after_s.size(), 1U);
  EXPECT_DOUBLE_EQ(score.known_after_s[0], 2.5);
}

TEST(ChangeScore, TimesInWhichItCouldBeSeen) {
  auto things = truth();
  const std::vector<MappedThing> found = {
      {"chair", {{box(0), at(1), at(8)}, {box(2), at(9.5), {}}}}};
  const ChangeScore untold = score_changes(found, things);
  EXPECT_TRUE(untold.freed_after_shown_s.empty());
  EXPECT_TRUE(untold.known_after_shown_s.empty());
  things[0].places[0].shown_empty = {{at(6), at(9)}};
  things[0].places[1].shown = {{at(7), at(7.5)}, {at(9), at(15)}};
  ChangeScore score = score_changes(found, things);
  EXPECT_EQ(score.freed_after_s, untold.freed_after_s);
  EXPECT_EQ(score.freed_after_shown_s, std::vector{2.0});
  EXPECT_EQ(score.known_after_shown_s, std::vector{1.0});
  EXPECT_NE(format_changes(score).find("of which it could be seen 1.0 s (at most 1.0 s)"),
            std::string::npos);
  things[0].places[1].shown = {{at(10), at(15)}};  // a glimpse was enough
  score = score_changes(found, things);
  EXPECT_EQ(score.known_after_shown_s, std::vector{0.0});
}

TEST(ChangeScore, OfAMapThatDidNot) {
  const std::vector<MappedThing> found = {{"chair", {{box(0), at(1), {}}}},
                                          {"chair", {{box(2), at(8), {}}}},
                                          {"dining table", {{box(5), at(1), at(6)}}}};
  const ChangeScore score = score_changes(found, truth());
  EXPECT_EQ(score.left, 1);
  EXPECT_EQ(score.freed, 0);
  EXPECT_TRUE(score.freed_after_s.empty());
  EXPECT_EQ(score.known, 1);
  EXPECT_EQ(score.same_number, 0);
  EXPECT_EQ(score.lost, 1);
}

TEST(ChangeScore, WhatHardlyAnyFrameShowedDoesNotCount) {
  auto things = truth();
  for (TrueThing& thing : things)
    for (TruePlace& place : thing.places) place.frames = 14;
  const ChangeScore score = score_changes({}, things);
  EXPECT_EQ(score.left + score.taken + score.stayed, 0);
  EXPECT_EQ(format_changes(score), "");
}

TEST(ChangeScore, StandingAtTheEndAreTheLastPlaces) {
  auto things = truth();
  things.push_back({"sports ball", false, {{box(9), at(0), at(3), 20}}});  // it rolls since
  const auto standing = standing_at_end(things);
  ASSERT_EQ(standing.size(), 3U);
  EXPECT_EQ(standing[0].box.centre_m.x(), 2);
  EXPECT_TRUE(standing[2].is_group);
}

TEST(ChangeScore, LeftPlacesThatWereNeverSeenEmpty) {
  auto things = truth();
  EXPECT_TRUE(left_unseen(things).empty()) << "not told";
  things[0].places[0].shown_empty.emplace();
  ASSERT_EQ(left_unseen(things).size(), 1U);
  EXPECT_EQ(left_unseen(things)[0].centre_m.x(), 0);
  things[0].places[0].shown_empty->push_back({at(6), at(7)});
  things[0].places[1].shown_empty.emplace();  // it stands there
  EXPECT_TRUE(left_unseen(things).empty());
}

TEST(ChangeScore, WhatCameToItsPlaceIsNoGhostThere) {
  const auto boxes = moved_and_standing(truth());
  ASSERT_EQ(boxes.size(), 1U);  // the chair; its old place and what never moved are none
  EXPECT_EQ(boxes[0].centre_m.x(), 2);
  UprightBox turned = box(2);
  turned.size_m = {2, 0.2, 1};
  turned.yaw_rad = std::numbers::pi / 2;
  const std::vector<Eigen::Vector3f> points{
      {2, 0.9F, 0}, {2.9F, 0, 0}, {2, 1.05F, 0}, {2, 1.2F, 0}};
  const auto apart = apart_from(points, std::vector{turned}, 0.1);
  EXPECT_EQ(apart, (std::vector{points[1], points[3]}));
  EXPECT_EQ(apart_from(points, {}, 0.1), points);
}

}  // namespace
}  // namespace ygslam
