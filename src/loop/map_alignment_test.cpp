#include "loop/map_alignment.hpp"

#include <gtest/gtest.h>

#include "loop/loop_test_world.hpp"

namespace ygslam {
namespace {

using Outcome = MapAlignment::Outcome;

SE3 turned_and_moved(double x_m) { return {so3_exp(Vec3(0, 0, 0.5)), Vec3(x_m, 1, -2)}; }

/// Views in b, one every half metre, which a shows where T_a_b puts them.
std::vector<MapPair> pairs_along(int count, const SE3& T_a_b, int first = 0) {
  std::vector<MapPair> pairs;
  for (int i = first; i < first + count; ++i) {
    MapPair pair;
    pair.in_b = KeyframeId{static_cast<std::uint32_t>(i)};
    pair.T_camera_b = SE3(Mat3::Identity(), Vec3(0.5 * i, 0, 0)).inverse();
    pair.match.place = KeyframeId{static_cast<std::uint32_t>(100 + i)};
    pair.match.verdict = PlaceVerdict::kAgrees;
    pair.match.inliers = 30 + i;
    pair.match.T_camera_world = pair.T_camera_b * T_a_b.inverse();
    pairs.push_back(pair);
  }
  return pairs;
}

void append(std::vector<MapPair>& pairs, const std::vector<MapPair>& more) {
  pairs.insert(pairs.end(), more.begin(), more.end());
}

double difference(const SE3& T_a, const SE3& T_b) { return (T_a.inverse() * T_b).log().norm(); }

TEST(MapAlignment, PairsThatAgreeAlignTwoMaps) {
  const SE3 T_a_b = turned_and_moved(3);
  const MapAlignment aligned = align_pairs(pairs_along(8, T_a_b), {});
  EXPECT_EQ(aligned.outcome, Outcome::kAligned);
  EXPECT_LT(difference(aligned.T_a_b, T_a_b), 1e-9);
  EXPECT_EQ(aligned.pairs.size(), 8U);
  EXPECT_EQ(aligned.found, 8);
  EXPECT_EQ(aligned.independent, 3) << "at 0, 1.5 and 3 m: over one metre apart";
  EXPECT_NEAR(aligned.extent_m, 3.5, 1e-9);
}

TEST(MapAlignment, FewIndependentViewsAreNoOverlap) {
  const SE3 T_a_b = turned_and_moved(3);
  const MapAlignment few = align_pairs(pairs_along(6, T_a_b), {});
  EXPECT_EQ(few.outcome, Outcome::kNoOverlap);
  EXPECT_EQ(few.independent, 2);
  EXPECT_LT(difference(few.T_a_b, T_a_b), 1e-9) << "it is told all the same";
  // Views from one place that look elsewhere are independent, too.
  std::vector<MapPair> turning = pairs_along(1, T_a_b);
  for (int i = 1; i < 3; ++i) {
    MapPair pair = turning.front();
    const SE3 T_turned = SE3(so3_exp(Vec3(0, 0.6 * i, 0)), Vec3::Zero());
    pair.in_b = KeyframeId{static_cast<std::uint32_t>(i)};
    pair.T_camera_b = T_turned * pair.T_camera_b;
    pair.match.T_camera_world = T_turned * pair.match.T_camera_world;
    turning.push_back(pair);
  }
  EXPECT_EQ(align_pairs(turning, {}).independent, 3);
  EXPECT_EQ(align_pairs({}, {}).outcome, Outcome::kNoOverlap);
}

TEST(MapAlignment, TheLargestSetThatAgreesCountsAndTheRestIsLeftOut) {
  const SE3 T_a_b = turned_and_moved(3);
  std::vector<MapPair> pairs = pairs_along(3, turned_and_moved(9), 20);
  append(pairs, pairs_along(8, T_a_b));
  const MapAlignment aligned = align_pairs(pairs, {});
  EXPECT_EQ(aligned.outcome, Outcome::kAligned);
  EXPECT_LT(difference(aligned.T_a_b, T_a_b), 1e-9);
  EXPECT_EQ(aligned.pairs.size(), 8U);
  EXPECT_EQ(aligned.found, 11);
}

TEST(MapAlignment, ARivalWithHalfTheSupportMakesItAmbiguous) {
  std::vector<MapPair> pairs = pairs_along(12, turned_and_moved(3));
  std::vector<MapPair> few = pairs;
  append(few, pairs_along(5, turned_and_moved(9), 20));
  EXPECT_EQ(align_pairs(few, {}).outcome, Outcome::kAligned);
  append(pairs, pairs_along(7, turned_and_moved(9), 20));
  EXPECT_EQ(align_pairs(pairs, {}).outcome, Outcome::kAmbiguous);
  MapAlignmentConfig bold;
  bold.ambiguous_share = 0.7;
  EXPECT_EQ(align_pairs(pairs, bold).outcome, Outcome::kAligned);
}

TEST(MapAlignment, DriftBetweenViewsIsAllowedByTheWayBetweenThem) {
  const auto drifted = [](double ratio) {
    std::vector<MapPair> pairs = pairs_along(41, SE3());
    for (MapPair& pair : pairs) {  // 20 m
      const double x_m = pair.T_camera_b.inverse().t().x();
      pair.match.T_camera_world =
          pair.match.T_camera_world * SE3(Mat3::Identity(), Vec3(0, -ratio * x_m, 0));
    }
    return align_pairs(pairs, {});
  };
  EXPECT_EQ(drifted(0.02).pairs.size(), 41U);
  EXPECT_LT(drifted(0.2).pairs.size(), 15U);
}

TEST(MapAlignment, OneWalkInTwoMapsIsFoundByWhatItShows) {
  loop_test::RingWorld ring(41);
  const loop_test::Walk first{.keyframes = 24, .drift_m = 0, .drift_rad = 0};
  loop_test::Walk second = first;
  second.first = 8;
  const Map a = ring.walk(first);
  Map b = ring.walk(second);
  const SE3 T_b_a = turned_and_moved(4);  // its world lies elsewhere
  MapPatch patch = b.start_patch();
  for (const auto& [id, keyframe] : b.keyframes())
    patch.poses.push_back({id, keyframe.T_camera_world, keyframe.T_camera_world * T_b_a.inverse()});
  b.apply(patch);
  const MapAlignment aligned = align_maps(a, b, ring.camera(), {});
  ASSERT_EQ(aligned.outcome, Outcome::kAligned);
  EXPECT_LT(difference(aligned.T_a_b, T_b_a.inverse()), 0.05);
  EXPECT_GE(aligned.found, 8);
}

TEST(MapAlignment, OfAnotherWorldNothingIsFound) {
  loop_test::RingWorld ring(42), other(43);
  const loop_test::Walk walk{.keyframes = 12, .drift_m = 0, .drift_rad = 0};
  const MapAlignment none = align_maps(ring.walk(walk), other.walk(walk), ring.camera(), {});
  EXPECT_EQ(none.outcome, Outcome::kNoOverlap);
  EXPECT_EQ(none.found, 0);
}

}  // namespace
}  // namespace ygslam
