#include "loop/place_finder.hpp"

#include <gtest/gtest.h>

#include "loop/loop_test_world.hpp"

namespace ygslam {
namespace {

using loop_test::RingWorld;

/// A map of one lap, without drift, and frames that look at it.
class PlaceFinderTest : public testing::Test {
 protected:
  void build(bool repeated = false) {
    if (repeated) ring_.repeat_half_a_turn_away();
    map_ = ring_.walk({.keyframes = 48, .drift_m = 0, .drift_rad = 0});
    index_.rebuild(map_);
  }
  struct Frame {
    map_test::SeenFrame seen;
    std::vector<float> weight;
    [[nodiscard]] PlaceView view() const { return {*seen.features, seen.grid, weight}; }
  };
  [[nodiscard]] Frame look(double turns) {
    Frame frame{ring_.world().see(loop_test::ring_pose(turns), 1000), {}};
    frame.weight.assign(frame.seen.features->size(), 1);
    return frame;
  }
  [[nodiscard]] std::vector<FoundPlace> find(const Frame& frame,
                                             const std::vector<KeyframeId>& excluded = {}) const {
    return finder_.find(map_, index_, frame.view(), excluded, 1);
  }

  RingWorld ring_{51};
  Map map_{{map_test::kLevels, map_test::kScale}};
  PlaceIndex index_;
  PlaceFinder finder_{{}, ring_.camera()};
};

TEST_F(PlaceFinderTest, OneFrameIsPlacedWhereItWasSeen) {
  build();
  for (const double turns : {0.1, 0.45, 0.8}) {
    const auto place = finder_.find_one(map_, index_, look(turns).view(), 1);
    ASSERT_TRUE(place) << turns;
    EXPECT_EQ(place->verdict, PlaceVerdict::kAgrees);
    EXPECT_LT((place->T_camera_world * loop_test::ring_pose(turns).inverse()).log().norm(), 0.01);
    const double keyframe_turns = static_cast<double>(index(place->place)) / 48;
    EXPECT_NEAR(keyframe_turns, turns, 0.1);
  }
}

TEST_F(PlaceFinderTest, CandidatesComeBestFirstAndNoMoreThanAsked) {
  build();
  const auto found = find(look(0.3));
  ASSERT_FALSE(found.empty());
  EXPECT_LE(found.size(), PlaceFinderConfig{}.places);
  for (std::size_t i = 1; i < found.size(); ++i) EXPECT_LE(found[i].score, found[i - 1].score);
}

TEST_F(PlaceFinderTest, WhatIsExcludedIsNoAnswer) {
  build();
  const Frame frame = look(0.3);
  ASSERT_FALSE(find(frame).empty());
  std::vector<KeyframeId> nearby;
  for (std::uint32_t i = 4; i < 25; ++i) nearby.push_back(KeyframeId{i});
  for (const FoundPlace& place : find(frame, nearby)) {
    EXPECT_FALSE(std::ranges::count(nearby, place.match.place));
    EXPECT_NE(place.match.verdict, PlaceVerdict::kAgrees);
  }
}

TEST_F(PlaceFinderTest, OfTwoPlacesThatLookAlikeItTellsNone) {
  build(true);
  const Frame frame = look(0.2);
  int agree = 0;
  for (const FoundPlace& place : find(frame))
    agree += place.match.verdict == PlaceVerdict::kAgrees ? 1 : 0;
  EXPECT_GE(agree, 2);
  EXPECT_FALSE(finder_.find_one(map_, index_, frame.view(), 1));
}

TEST_F(PlaceFinderTest, NothingIsFoundOfAnotherWorldNorOfWhatMoves) {
  build();
  RingWorld other(52);
  const auto seen = other.world().see(loop_test::ring_pose(0.3), 1000);
  const std::vector<float> weight(seen.features->size(), 1);
  EXPECT_FALSE(finder_.find_one(map_, index_, {*seen.features, seen.grid, weight}, 1));
  Frame moving = look(0.3);
  moving.weight.assign(moving.weight.size(), 0);
  EXPECT_TRUE(find(moving).empty());
}

TEST_F(PlaceFinderTest, RivalsAreElsewhereAndFitAboutAsWell) {
  PlaceMatch best;
  best.inliers = 100;
  PlaceMatch other = best;
  EXPECT_FALSE(finder_.rivals(best, other)) << "the same place";
  other.T_camera_world = SE3(Mat3::Identity(), Vec3(0.4, 0, 0));
  EXPECT_FALSE(finder_.rivals(best, other)) << "still the same";
  other.T_camera_world = SE3(Mat3::Identity(), Vec3(0.6, 0, 0));
  EXPECT_TRUE(finder_.rivals(best, other));
  other.inliers = 69;
  EXPECT_FALSE(finder_.rivals(best, other)) << "it fits clearly worse";
  other.inliers = 70;
  EXPECT_TRUE(finder_.rivals(best, other));
  other.T_camera_world = SE3(so3_exp(Vec3(0, 0.2, 0)), Vec3::Zero());
  EXPECT_TRUE(finder_.rivals(best, other)) << "it looks another way";
}

}  // namespace
}  // namespace ygslam
