#include "loop/loop_graph.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "loop/loop_test_world.hpp"

namespace ygslam {
namespace {

constexpr double kStride_m = 0.3;

SE3 T_camera_at(double x_m, double y_m = 0) {
  return SE3(Mat3::Identity(), Vec3(x_m, y_m, 0)).inverse();
}

KeyframeId number(int i) { return KeyframeId{static_cast<std::uint32_t>(i)}; }

/// Keyframes in a row, each tied to the one before.
MapGraph row(int keyframes) {
  MapGraph graph;
  graph.roots = {number(0)};
  for (int i = 0; i < keyframes; ++i) {
    graph.T_camera_world[number(i)] = T_camera_at(kStride_m * i);
    if (i > 0) graph.edges.push_back({.from = number(i - 1), .to = number(i)});
  }
  return graph;
}

/// The motion between two keyframes of the row, wrong by so much.
LoopEdge loop(const MapGraph& graph, int from, int to, double off_m) {
  const SE3 T_to_from =
      graph.T_camera_world.at(number(to)) * graph.T_camera_world.at(number(from)).inverse();
  return {number(from), number(to), T_camera_at(0, off_m) * T_to_from};
}

constexpr double kDriftRatio = 0.02;

double length_m(const MapGraph& graph, int from, int to) {
  return least_drift_way(graph, number(from), number(to), kDriftRatio).length_m;
}

/// Of the same deviation along each axis.
Mat6 covariance(double std_m, double std_rad) {
  Vec6 variances;
  variances << Vec3::Constant(std_m * std_m), Vec3::Constant(std_rad * std_rad);
  return variances.asDiagonal();
}

double y_m(const SE3& T_camera_world) { return T_camera_world.inverse().t().y(); }

TEST(MapGraph, HasEveryKeyframeAndTiesWhereTheyAreStrong) {
  loop_test::RingWorld ring(31);
  const Map map = ring.walk({.keyframes = 8, .torn_at = 5, .drift_m = 0, .drift_rad = 0});
  const MapGraph all = make_map_graph(map, 1);
  const MapGraph strong = make_map_graph(map, 150);
  const MapGraph none = make_map_graph(map, 100'000);
  EXPECT_EQ(all.T_camera_world.size(), 8U);
  EXPECT_EQ(all.roots, (std::set{number(0), number(5)}));
  EXPECT_GT(all.edges.size(), strong.edges.size());
  EXPECT_GT(strong.edges.size(), none.edges.size());
  EXPECT_EQ(none.edges.size(), 6U) << "a parent is a tie however little is shared";
  for (const MapGraph::Edge& edge : all.edges) {
    EXPECT_LT(edge.from, edge.to);
    const double degrees = static_cast<double>(map.keyframe(edge.from).covisible.size() +
                                               map.keyframe(edge.to).covisible.size());
    EXPECT_NEAR(edge.information, 2 / degrees, 1e-12) << "edges side by side count less";
    EXPECT_EQ(edge.to < number(5), edge.from < number(5)) << "nothing leads over the tear";
  }
}

TEST(MapGraph, AKeyframeThatSharesNothingIsTiedToItsParent) {
  loop_test::RingWorld ring(32);
  Map map = ring.walk({.keyframes = 3, .drift_m = 0, .drift_rad = 0});
  const auto seen = ring.world().see(loop_test::ring_pose(0.5), 3);
  const KeyframeId alone = map_test::add_keyframe(map, seen, number(1));
  const MapGraph graph = make_map_graph(map, 15);
  EXPECT_EQ(std::ranges::count(graph.edges, alone, &MapGraph::Edge::to), 1);
  EXPECT_EQ(graph.edges.back().from, number(1));
  EXPECT_FALSE(graph.roots.contains(alone));
}

TEST(MapGraph, AKeyframeAfterCoastingIsTiedByItsMotion) {
  loop_test::RingWorld ring(33);
  const Map map = ring.walk(
      {.keyframes = 8, .coasted_at = 5, .coasted_std_m = 0.2, .drift_m = 0, .drift_rad = 0});
  const MapGraph graph = make_map_graph(map, 15);
  int over_it = 0;
  for (const MapGraph::Edge& edge : graph.edges) {
    const bool leads_over = edge.from < number(5) && edge.to >= number(5);
    EXPECT_EQ(edge.covariance.has_value(), leads_over);
    if (!leads_over) continue;
    ++over_it;
    EXPECT_EQ(edge.from, number(4));
    EXPECT_EQ(edge.to, number(5));
    EXPECT_EQ(*edge.covariance, map.keyframe(number(5)).motion->covariance);
  }
  EXPECT_EQ(over_it, 1);
}

TEST(MapGraph, WhatIsSeenFromBothEndsOfAMotionTiesThem) {
  loop_test::RingWorld ring(34);
  Map map = ring.walk({.keyframes = 8, .drift_m = 0, .drift_rad = 0});
  map.set_motion(number(5), {number(4), SE3(), covariance(0.2, 0.01)});
  const MapGraph graph = make_map_graph(map, 15);
  for (const MapGraph::Edge& edge : graph.edges) EXPECT_FALSE(edge.covariance);
  EXPECT_EQ(graph.edges.size(), make_map_graph(ring.walk({.keyframes = 8}), 15).edges.size());
}

TEST(MapGraph, CoastingOnAWayMayHaveMovedItsStart) {
  MapGraph graph = row(9);
  const auto way = [&] { return least_drift_way(graph, number(8), number(0), kDriftRatio); };
  EXPECT_EQ(way().coasted_m, 0);
  graph.edges[3].covariance = covariance(0.1, 0);  // of 3 -> 4
  EXPECT_NEAR(way().length_m, 8 * kStride_m, 1e-12);
  EXPECT_NEAR(way().coasted_m, 3 * std::sqrt(3) * 0.1, 1e-9);
  graph.edges[3].covariance = covariance(0, 0.05);
  EXPECT_NEAR(way().coasted_m, 3 * std::sqrt(3) * 0.05 * 4 * kStride_m, 1e-9)
      << "what it turned wrongly, as far as the start is away";
  // A way of six metres without coasting drifts less.
  graph.T_camera_world[number(9)] = T_camera_at(3.5 * kStride_m, 3);
  graph.edges.push_back({.from = number(3), .to = number(9)});
  graph.edges.push_back({.from = number(4), .to = number(9)});
  EXPECT_EQ(way().coasted_m, 0);
  EXPECT_GT(way().length_m, 8 * kStride_m + 5);
}

TEST(MapGraph, AWayIsTheShortestAlongTies) {
  MapGraph graph = row(5);
  EXPECT_NEAR(length_m(graph, 0, 4), 4 * kStride_m, 1e-12);
  EXPECT_NEAR(length_m(graph, 4, 1), 3 * kStride_m, 1e-12) << "either way";
  EXPECT_EQ(length_m(graph, 2, 2), 0);
  // A detour through a sixth keyframe is longer, a tie across is shorter.
  graph.T_camera_world[number(5)] = T_camera_at(2 * kStride_m, 5);
  graph.edges.push_back({.from = number(0), .to = number(5)});
  graph.edges.push_back({.from = number(4), .to = number(5)});
  EXPECT_NEAR(length_m(graph, 0, 4), 4 * kStride_m, 1e-12);
  graph.T_camera_world[number(3)] = T_camera_at(3 * kStride_m, 2);
  graph.edges.push_back({.from = number(2), .to = number(4)});
  EXPECT_NEAR(length_m(graph, 0, 4), 4 * kStride_m, 1e-12);
}

TEST(MapGraph, WhereNothingLeadsTheWayIsInfinite) {
  MapGraph graph = row(3);
  graph.T_camera_world[number(7)] = T_camera_at(0.1);
  EXPECT_TRUE(std::isinf(length_m(graph, 0, 7)));
}

TEST(WeighedLoops, WithoutLoopsNothingMoves) {
  const MapGraph graph = row(6);
  const WeighedLoops weighed = weigh_loops(graph, {}, {});
  EXPECT_TRUE(weighed.kept.empty());
  EXPECT_NEAR(weighed.stretch, 0, 1e-9);
  for (const auto& [id, T_camera_world] : graph.T_camera_world)
    EXPECT_LT((weighed.T_camera_world.at(id) * T_camera_world.inverse()).log().norm(), 1e-9);
}

TEST(WeighedLoops, ALoopBendsTheRowTowardsWhatItMeasured) {
  const MapGraph graph = row(30);
  const double drift_m = 0.1;
  const std::vector<LoopEdge> loops = {loop(graph, 0, 28, drift_m), loop(graph, 0, 29, drift_m)};
  const WeighedLoops weighed = weigh_loops(graph, loops, {});
  EXPECT_EQ(weighed.kept, (std::vector<std::uint8_t>{1, 1}));
  EXPECT_LT(weighed.stretch, 3);
  EXPECT_NEAR(std::abs(y_m(weighed.T_camera_world.at(number(29)))), drift_m, 0.03);
  EXPECT_EQ(y_m(weighed.T_camera_world.at(number(0))), 0) << "the root stays";
  double before_m = 0;
  for (const auto& [id, T_camera_world] : weighed.T_camera_world) {
    EXPECT_GE(std::abs(y_m(T_camera_world)), before_m - 0.01) << "evenly along the way";
    before_m = std::abs(y_m(T_camera_world));
  }
}

// A loop that says how the last place lies to the first turns what lies between, too, if nobody
// knows what is upright.
TEST(WeighedLoops, GravityKeepsKeyframesUprightWhereALoopBendsTheRow) {
  const auto worst_tilt_rad = [](bool has_gravity) {
    MapGraph graph = row(30);
    for (int i = 0; has_gravity && i < 30; ++i)
      graph.gravity[number(i)] = {0, Vec3::UnitZ(), Vec3::UnitZ(), 1e6 * Mat3::Identity()};
    std::vector<LoopEdge> loops = {loop(graph, 0, 28, 0), loop(graph, 0, 29, 0)};
    for (LoopEdge& edge : loops)
      edge.T_to_from = SE3(Mat3::Identity(), {0, 0, 0.15}) * edge.T_to_from;
    const WeighedLoops weighed = weigh_loops(graph, loops, {});
    EXPECT_EQ(weighed.kept, (std::vector<std::uint8_t>{1, 1}));
    EXPECT_NEAR(weighed.T_camera_world.at(number(29)).t().z(), 0.15, 0.05);
    double worst = 0;
    for (const auto& [id, T_camera_world] : weighed.T_camera_world)
      worst = std::max(worst, (T_camera_world.R() * Vec3::UnitZ() - Vec3::UnitZ()).norm());
    return worst;
  };
  EXPECT_GT(worst_tilt_rad(false), 0.005);
  EXPECT_LT(worst_tilt_rad(true), 0.001);
}

TEST(WeighedLoops, WhatWasCoastedTakesUpWhatTheLoopsSay) {
  MapGraph graph = row(30);
  graph.edges[14].covariance = covariance(0.25, 0.02);  // of 14 -> 15
  const double off_m = 0.5;
  const std::vector<LoopEdge> loops = {loop(graph, 0, 27, off_m), loop(graph, 0, 28, off_m),
                                       loop(graph, 0, 29, off_m)};
  const WeighedLoops weighed = weigh_loops(graph, loops, {});
  EXPECT_EQ(weighed.kept, (std::vector<std::uint8_t>{1, 1, 1}));
  EXPECT_LT(weighed.stretch, 3);
  EXPECT_NEAR(y_m(weighed.T_camera_world.at(number(14))), 0, 0.1) << "not 0.24";
  for (int i = 15; i < 30; ++i)
    EXPECT_NEAR(std::abs(y_m(weighed.T_camera_world.at(number(i)))), off_m, 0.1) << i;
}

TEST(WeighedLoops, ALoopThatOthersContradictIsLeftOut) {
  const MapGraph graph = row(30);
  const std::vector<LoopEdge> loops = {loop(graph, 0, 27, 0.02), loop(graph, 0, 28, 0.02),
                                       loop(graph, 0, 29, 0.02), loop(graph, 1, 29, 2.0)};
  const WeighedLoops weighed = weigh_loops(graph, loops, {});
  EXPECT_EQ(weighed.kept, (std::vector<std::uint8_t>{1, 1, 1, 0}));
  EXPECT_NEAR(std::abs(y_m(weighed.T_camera_world.at(number(29)))), 0.02, 0.02);
  EXPECT_LT(weighed.stretch, 3) << "what does not count does not stretch";
}

}  // namespace
}  // namespace ygslam
