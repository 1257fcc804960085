#include <gtest/gtest.h>

#include "loop/loop_closer.hpp"
#include "loop/loop_test_world.hpp"

namespace ygslam {
namespace {

using loop_test::RingWorld;
using loop_test::Walk;

constexpr KeyframeId kFirst{0};

KeyframeId newest(const Map& map) { return map.keyframes().rbegin()->first; }

PlaceIndex index_of(const Map& map) {
  PlaceIndex index;
  index.rebuild(map);
  return index;
}

/// Largest distance of a keyframe's centre from its true place.
double largest_error_m(const Map& map, const Walk& walk) {
  double largest = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    const Vec3 truth = RingWorld::true_pose(walk, static_cast<int>(index(id))).inverse().t();
    largest = std::max(largest, (keyframe.position_world() - truth).norm());
  }
  return largest;
}

TEST(PlaceIndex, FindsTheKeyframesThatSawTheSame) {
  RingWorld ring(1);
  const Walk walk;
  const Map map = ring.walk(walk);
  const PlaceIndex index = index_of(map);
  const Keyframe& last = map.keyframe(newest(map));
  const auto hits = index.query(map, *last.data->features, last.static_weight);
  std::vector<KeyframeId> lap_two;
  for (int i = 40; i < walk.keyframes; ++i) lap_two.push_back(KeyframeId(i));
  const auto places = index.candidates(map, hits, lap_two, 3);
  ASSERT_FALSE(places.empty());
  // The last keyframe looks where keyframe 9 looked a lap before.
  EXPECT_NEAR(ygslam::index(places.front().keyframe), walk.keyframes - 1 - walk.keyframes_per_lap,
              3);
  for (std::size_t i = 1; i < places.size(); ++i) EXPECT_LE(places[i].score, places[i - 1].score);
}

TEST(PlaceIndex, NothingInAnotherWorld) {
  RingWorld ring(2), other(3);
  const Map map = ring.walk({});
  const Map elsewhere = other.walk({});
  const PlaceIndex index = index_of(map);
  const Keyframe& view = elsewhere.keyframe(kFirst);
  EXPECT_TRUE(
      index.candidates(map, index.query(map, *view.data->features, view.static_weight), {}, 3)
          .empty());
}

TEST(PlaceIndex, KnowsProvedLandmarksOnlyAndForgetsThoseThatLeave) {
  RingWorld ring(4);
  Map map = ring.walk({});
  PlaceIndex index = index_of(map);
  std::size_t proved = 0;
  std::vector<LandmarkId> all;
  map.for_each_landmark([&](const Landmark& l) {
    proved += l.observations.size() >= 3 ? 1 : 0;
    all.push_back(l.id);
  });
  EXPECT_EQ(index.size(), proved);
  const Keyframe& view = map.keyframe(kFirst);
  const auto weight = view.static_weight;
  const FeaturesPtr features = view.data->features;
  EXPECT_FALSE(index.query(map, *features, weight).empty());
  EXPECT_TRUE(index.query(map, *features, std::vector<float>(weight.size(), 0)).empty())
      << "moving things are not asked";
  for (const LandmarkId id : all) map.remove_landmark(id);
  EXPECT_TRUE(index.query(map, *features, weight).empty());
}

TEST(PlaceIndex, GrowsKeyframeByKeyframeToWhatARebuildGives) {
  RingWorld ring(5);
  const Map map = ring.walk({});
  PlaceIndex grown;
  for (const auto& [id, keyframe] : map.keyframes()) grown.add(map, id);
  const PlaceIndex rebuilt = index_of(map);
  EXPECT_EQ(grown.size(), rebuilt.size());
  const Keyframe& view = map.keyframe(newest(map));
  const auto a = grown.query(map, *view.data->features, view.static_weight);
  const auto b = rebuilt.query(map, *view.data->features, view.static_weight);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].landmark, b[i].landmark);
}

LoopResult close_loop(const RingWorld& ring, const Map& map, LoopConfig config = {}) {
  LoopCloser closer(config, ring.camera());
  return closer.step(map, index_of(map), newest(map));
}

TEST(LoopCloser, TakesTheDriftOutOfALap) {
  RingWorld ring(7);
  const Walk walk;
  Map map = ring.walk(walk);
  const double before_m = largest_error_m(map, walk);
  const LoopResult result = close_loop(ring, map);
  ASSERT_TRUE(result.closure);
  EXPECT_EQ(result.attempts.front().outcome, LoopOutcome::kClosed);
  EXPECT_GE(result.attempts.front().agreeing, 2);
  EXPECT_NEAR(result.attempts.front().correction_m, walk.drift_m, 0.1);
  map.apply(result.closure->patch);
  EXPECT_GT(before_m, 0.15);
  EXPECT_LT(largest_error_m(map, walk), 0.35 * before_m);
}

TEST(LoopCloser, OdometryCannotHaveDriftedSoFar) {
  RingWorld ring(8);
  const LoopResult result = close_loop(ring, ring.walk({.drift_m = 2.5}));
  ASSERT_FALSE(result.attempts.empty());
  EXPECT_FALSE(result.closure);
  EXPECT_EQ(result.attempts.front().match.verdict, PlaceVerdict::kAgrees);
  EXPECT_EQ(result.attempts.front().outcome, LoopOutcome::kTooFar);
}

TEST(LoopCloser, WhatWasCoastedMayBeWrongByAsMuchAsItSays) {
  RingWorld ring(14);
  Walk walk{.coasted_at = 40, .coasted_m = 0.6, .coasted_std_m = 0.25};
  walk.drift_m = walk.drift_rad = 0;
  Map map = ring.walk(walk);
  const LoopResult result = close_loop(ring, map);
  ASSERT_FALSE(result.attempts.empty());
  EXPECT_EQ(result.attempts.front().outcome, LoopOutcome::kClosed);
  ASSERT_TRUE(result.closure);
  EXPECT_NEAR(result.attempts.front().coasted_m, 3 * walk.coasted_std_m, 0.01);
  map.apply(result.closure->patch);
  EXPECT_LT(largest_error_m(map, walk), 0.1);
  walk.coasted_m = 1.2;
  const LoopResult farther = close_loop(ring, ring.walk(walk));
  ASSERT_FALSE(farther.attempts.empty());
  EXPECT_EQ(farther.attempts.front().outcome, LoopOutcome::kTooFar);
}

TEST(LoopCloser, OdometryThatDoesNotReachThePlaceAllowsNothing) {
  RingWorld ring(13);
  const LoopResult result =
      close_loop(ring, ring.walk({.torn_at = 40, .drift_m = 0, .drift_rad = 0}));
  ASSERT_FALSE(result.attempts.empty());
  EXPECT_FALSE(result.closure);
  EXPECT_EQ(result.attempts.front().match.verdict, PlaceVerdict::kAgrees);
  EXPECT_EQ(result.attempts.front().outcome, LoopOutcome::kOtherSubmap);
}

TEST(LoopCloser, AKeyframeAloneIsNotBelieved) {
  RingWorld ring(9);
  LoopConfig config;
  config.min_agreeing = 6;
  const LoopResult result = close_loop(ring, ring.walk({}), config);
  ASSERT_FALSE(result.attempts.empty());
  EXPECT_FALSE(result.closure);
  EXPECT_EQ(result.attempts.front().outcome, LoopOutcome::kAlone);
}

TEST(LoopCloser, TwoPlacesThatLookAlikeAreAmbiguous) {
  // Odometry is made so bad that it allows both.
  RingWorld ring(10);
  ring.repeat_half_a_turn_away();
  const Map map = ring.walk({.drift_m = 0, .drift_rad = 0});
  LoopConfig config;
  config.max_drift_m = 100;
  config.max_drift_rad = 4;
  const LoopResult result = close_loop(ring, map, config);
  EXPECT_FALSE(result.closure);
  EXPECT_TRUE(std::any_of(result.attempts.begin(), result.attempts.end(),
                          [](const auto& a) { return a.outcome == LoopOutcome::kAmbiguous; }));
  // An honest odometry tells them apart.
  EXPECT_TRUE(close_loop(ring, map).closure);
}

TEST(LoopCloser, WithoutARevisitNothingIsCompared) {
  RingWorld ring(11);
  EXPECT_FALSE(close_loop(ring, ring.walk({.keyframes = 30})).closure);
}

TEST(LoopCloser, TheSameTwiceGivesTheSame) {
  RingWorld ring(12);
  const Map map = ring.walk({});
  const LoopResult a = close_loop(ring, map);
  const LoopResult b = close_loop(ring, map);
  ASSERT_TRUE(a.closure && b.closure);
  ASSERT_EQ(a.closure->patch.poses.size(), b.closure->patch.poses.size());
  for (std::size_t i = 0; i < a.closure->patch.poses.size(); ++i)
    EXPECT_EQ(a.closure->patch.poses[i].T_camera_world.t(),
              b.closure->patch.poses[i].T_camera_world.t());
}

TEST(LoopAttempts, WhatWasClosedIsKeptHoweverManyWereRefused) {
  const auto attempt = [](LoopOutcome outcome) {
    LoopAttempt made;
    made.outcome = outcome;
    return made;
  };
  const std::vector<LoopAttempt> tried = {
      attempt(LoopOutcome::kRefused), attempt(LoopOutcome::kClosed), attempt(LoopOutcome::kAlone)};
  std::vector<LoopAttempt> kept;
  for (int k = 0; k < 3; ++k) append_attempts(tried, 3, kept);
  std::vector<LoopOutcome> outcomes;
  for (const LoopAttempt& a : kept) outcomes.push_back(a.outcome);
  using enum LoopOutcome;
  EXPECT_EQ(outcomes, (std::vector{kRefused, kClosed, kAlone, kClosed, kClosed}));
}

}  // namespace
}  // namespace ygslam
