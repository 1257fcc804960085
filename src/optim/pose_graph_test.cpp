#include "optim/pose_graph.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "core/check.hpp"
#include "geometry/properties_testing.hpp"
#include "optim/synthetic_pose_graph.hpp"

namespace ygslam {
namespace {

using synthetic::Laps;
using synthetic::pose_graph_world;
using synthetic::PoseGraphWorld;
using synthetic::position_error_m;

RC_GTEST_PROP(PoseGraphProperties, JacobiansMatchFiniteDifferences, ()) {
  using properties::motion;
  const SE3 T_from_world = properties::pose(), T_to_world = properties::pose();
  PoseGraphEdge edge;
  edge.T_to_from = motion(2.5, 2) * T_to_world * T_from_world.inverse();
  const Vec6 e = pose_graph_residual(edge, T_from_world, T_to_world);
  const PoseGraphJacobians J = pose_graph_jacobians(e, T_from_world, T_to_world);
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 6; ++i) {
    const SE3 plus = SE3::exp(kStep * Vec6::Unit(i)), minus = plus.inverse();
    const Vec6 from = (pose_graph_residual(edge, plus * T_from_world, T_to_world) -
                       pose_graph_residual(edge, minus * T_from_world, T_to_world)) /
                      (2 * kStep);
    const Vec6 to = (pose_graph_residual(edge, T_from_world, plus * T_to_world) -
                     pose_graph_residual(edge, T_from_world, minus * T_to_world)) /
                    (2 * kStep);
    RC_ASSERT((J.from.col(i) - from).norm() < 1e-6 * (1 + from.norm()));
    RC_ASSERT((J.to.col(i) - to).norm() < 1e-6 * (1 + to.norm()));
  }
}

RC_GTEST_PROP(PoseGraphProperties, ResidualMovesTheMeasurementToWhatThePosesSay, ()) {
  const SE3 T_from_world = properties::pose(), T_to_world = properties::pose();
  PoseGraphEdge edge;
  edge.T_to_from = properties::motion(2.5, 2) * T_to_world * T_from_world.inverse();
  const Vec6 e = pose_graph_residual(edge, T_from_world, T_to_world);
  const SE3 T_to_from = SE3::exp(e) * edge.T_to_from;
  RC_ASSERT((T_to_from.R() * T_from_world.R() - T_to_world.R()).norm() < 1e-6);
  RC_ASSERT((T_to_from * T_from_world.t() - T_to_world.t()).norm() < 1e-6);
}

TEST(PoseGraph, RecoversANoiseFreeLoopExactly) {
  Rng rng(1);
  Laps laps = {.poses = 120, .laps = 2, .loops = 20};
  PoseGraphWorld world = pose_graph_world(laps, rng);
  for (PoseGraphEdge& edge : world.graph.edges) {
    edge.T_to_from = world.T_camera_world[edge.to] * world.T_camera_world[edge.from].inverse();
    edge.information = synthetic::random_information(rng);
  }
  ASSERT_GT(position_error_m(world, world.graph.T_camera_world), 0.005);
  const PoseGraphResult result = optimize_pose_graph(world.graph, {});
  EXPECT_TRUE(result.converged);
  EXPECT_LT(result.iterations, 30);
  EXPECT_LT(result.cost, 1e-10);
  for (std::size_t i = 0; i < world.T_camera_world.size(); ++i) {
    EXPECT_LT((result.T_camera_world[i] * world.T_camera_world[i].inverse()).log().norm(), 1e-8);
  }
}

TEST(PoseGraph, LoopsTakeTheDriftOut) {
  Rng rng(2);
  const PoseGraphWorld world = pose_graph_world({}, rng);
  const PoseGraphResult result = optimize_pose_graph(world.graph, {});
  EXPECT_TRUE(result.converged);
  EXPECT_LT(position_error_m(world, result.T_camera_world),
            0.5 * position_error_m(world, world.graph.T_camera_world));
  EXPECT_LT(result.cost, result.initial_cost);
  // Half of chi2 with six degrees of freedom per edge, less six per free pose.
  const double expected = 3.0 * (static_cast<double>(world.graph.edges.size()) - 299);
  EXPECT_NEAR(result.cost, expected, 4 * std::sqrt(expected));
}

// What the loops that are right make of the odometry, and what is made of it with the wrong ones.
struct Robustness {
  double clean_m, error_m;
  int wrong_kept = 0, true_lost = 0;
};

Robustness optimize_with_wrong_loops(const PoseGraphWorld& world) {
  PoseGraphWorld clean = world;
  clean.graph.edges.clear();
  for (std::size_t i = 0; i < world.is_wrong.size(); ++i) {
    if (!world.is_wrong[i]) clean.graph.edges.push_back(world.graph.edges[i]);
  }
  const PoseGraphResult reference = optimize_pose_graph(clean.graph, {.gnc = false});
  const PoseGraphResult result = optimize_pose_graph(world.graph, {});
  EXPECT_TRUE(reference.converged && result.converged);
  Robustness r{position_error_m(world, reference.T_camera_world),
               position_error_m(world, result.T_camera_world)};
  for (std::size_t i = 0; i < world.is_wrong.size(); ++i) {
    const bool is_kept = result.edge_weight[i] > 0;
    r.wrong_kept += is_kept && world.is_wrong[i] ? 1 : 0;
    r.true_lost += !is_kept && !world.is_wrong[i] ? 1 : 0;
    EXPECT_TRUE(world.graph.edges[i].robust || is_kept);
  }
  return r;
}

class RandomWrongLoops : public testing::TestWithParam<int> {};

TEST_P(RandomWrongLoops, AreLeftOut) {
  const int percent = GetParam();
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Rng rng(seed);
    const Laps laps;
    PoseGraphWorld world = pose_graph_world(laps, rng);
    synthetic::add_random_wrong_loops(world, laps.loops * percent / (100 - percent), laps, rng);
    const Robustness r = optimize_with_wrong_loops(world);
    EXPECT_LE(r.error_m, (percent > 50 ? 1.5 : 1.3) * r.clean_m) << "seed " << seed;
    EXPECT_EQ(r.wrong_kept, 0) << "seed " << seed;
    EXPECT_LE(r.true_lost, laps.loops / 10) << "seed " << seed;
  }
}
INSTANTIATE_TEST_SUITE_P(PoseGraph, RandomWrongLoops, testing::Values(10, 30, 50, 70));

TEST(PoseGraph, TenWrongLoopsThatAgreeWithEachOtherLoseToOdometryAndTrueLoops) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Rng rng(seed);
    const Laps laps;
    PoseGraphWorld world = pose_graph_world(laps, rng);
    synthetic::add_coherent_wrong_loops(world, 10, 20, 260, Vec3(6, 0, 0), laps, rng);
    const Robustness r = optimize_with_wrong_loops(world);
    EXPECT_LE(r.error_m, 1.1 * r.clean_m) << "seed " << seed;
    EXPECT_EQ(r.wrong_kept, 0) << "seed " << seed;
  }
}

// The information of the odometry alone decides here: leaving out a group of k costs
// k * inlier_chi2, keeping it k * 6 on average and the square of the shift, in deviations of the
// way between its ends.
TEST(PoseGraph, WrongLoopsThatAgreeWinWhereTheOdometryIsTooVagueToContradict) {
  constexpr int kGroup = 10;
  const Laps laps = {.poses = 100, .laps = 1, .loops = 0, .odometry_m = 0.05, .odometry_rad = 1e-5};
  const double way_sigma_m = laps.odometry_m * laps.step_m * std::sqrt(60.0);
  const double limit_m = std::sqrt(kGroup * (PoseGraphConfig().inlier_chi2 - 6)) * way_sigma_m;
  for (const double share : {0.5, 1.5}) {
    Rng rng(3);
    PoseGraphWorld world = pose_graph_world(laps, rng);
    synthetic::add_coherent_wrong_loops(world, kGroup, 20, 80, Vec3(share * limit_m, 0, 0), laps,
                                        rng);
    const PoseGraphResult result = optimize_pose_graph(world.graph, {});
    const auto kept = std::count(result.edge_weight.end() - kGroup, result.edge_weight.end(), 1.0);
    if (share < 1) {
      EXPECT_GE(kept, kGroup - 1);  // each is 99 % of inliers' own
    } else {
      EXPECT_EQ(kept, 0);
    }
  }
}

TEST(PoseGraph, WithoutGncEveryEdgeKeepsItsWeight) {
  Rng rng(4);
  const Laps laps;
  PoseGraphWorld world = pose_graph_world(laps, rng);
  synthetic::add_random_wrong_loops(world, 5, laps, rng);
  const PoseGraphResult result = optimize_pose_graph(world.graph, {.gnc = false});
  for (const double weight : result.edge_weight) EXPECT_EQ(weight, 1.0);
  EXPECT_GT(position_error_m(world, result.T_camera_world), 0.3);
}

TEST(PoseGraph, StopsWhereTheFlagIsSet) {
  Rng rng(5);
  const Laps laps;
  PoseGraphWorld world = pose_graph_world(laps, rng);
  synthetic::add_random_wrong_loops(world, 20, laps, rng);
  const std::atomic<bool> abort = true;
  const PoseGraphResult result = optimize_pose_graph(world.graph, {}, &abort);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.iterations, 0);
  EXPECT_EQ(position_error_m(world, result.T_camera_world),
            position_error_m(world, world.graph.T_camera_world));
  EXPECT_LE(optimize_pose_graph(world.graph, {.max_iterations = 7}).iterations, 7);
}

TEST(PoseGraph, StoppedAtAnyMomentItIsNoWorseThanItWas) {
  Rng rng(10);
  const PoseGraphWorld world = pose_graph_world({.neighbours = 3}, rng);
  int stopped = 0;
  for (int delay_us = 0; delay_us < 6000; delay_us += 300) {
    std::atomic<bool> abort = false;
    std::jthread other([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(delay_us));
      abort = true;
    });
    const PoseGraphResult result = optimize_pose_graph(world.graph, {.gnc = false}, &abort);
    stopped += result.converged ? 0 : 1;
    EXPECT_LE(result.cost, result.initial_cost);
    for (const SE3& T : result.T_camera_world) EXPECT_TRUE(T.is_finite());
  }
  EXPECT_GT(stopped, 0);
}

TEST(PoseGraph, TheSameInputGivesTheSameBytes) {
  const auto run = [] {
    Rng rng(6);
    const Laps laps = {.neighbours = 3};
    PoseGraphWorld world = pose_graph_world(laps, rng);
    synthetic::add_random_wrong_loops(world, 30, laps, rng);
    return optimize_pose_graph(world.graph, {});
  };
  const PoseGraphResult a = run(), b = run();
  EXPECT_EQ(std::memcmp(a.T_camera_world.data(), b.T_camera_world.data(),
                        a.T_camera_world.size() * sizeof(SE3)),
            0);
  EXPECT_EQ(a.edge_weight, b.edge_weight);
}

TEST(PoseGraph, PartsWithoutAFixedPoseAreOptimisedWhereTheyStand) {
  Rng rng(7);
  const Laps laps = {.poses = 90};
  PoseGraphWorld world = pose_graph_world(laps, rng);
  const PoseGraphResult alone = optimize_pose_graph(world.graph, {});
  // The same twice, not connected, nothing fixed in the second; and a pose without any edge.
  PoseGraph both = world.graph;
  const SE3 T_moved = SE3::exp(synthetic::random_twist(rng, 5, 1));
  for (const SE3& T : world.graph.T_camera_world) both.T_camera_world.push_back(T * T_moved);
  both.T_camera_world.push_back(T_moved);
  both.fixed.resize(both.T_camera_world.size(), 0);
  for (PoseGraphEdge edge : world.graph.edges) {
    edge.from += 90, edge.to += 90;
    both.edges.push_back(edge);
  }
  const PoseGraphResult result = optimize_pose_graph(both, {});
  EXPECT_TRUE(result.converged);
  EXPECT_NEAR(result.cost, 2 * alone.cost, 1e-6 * alone.cost);
  for (std::size_t i = 0; i < 90; ++i) {
    const SE3& first = result.T_camera_world[i];
    const SE3 second = result.T_camera_world[90 + i] * T_moved.inverse();
    EXPECT_LT((first * alone.T_camera_world[i].inverse()).log().norm(), 1e-5);
    EXPECT_LT((second * alone.T_camera_world[i].inverse()).log().norm(), 1e-5);
  }
  EXPECT_EQ(result.T_camera_world[180].t(), T_moved.t());
}

TEST(PoseGraph, APartThatHangsOnARefusedLoopStaysWhole) {
  Rng rng(8);
  const Laps laps = {.poses = 90, .loops = 30};
  PoseGraphWorld world = pose_graph_world(laps, rng);
  // The chain is cut at 45; three loops across it agree, one says something else.
  std::erase_if(world.graph.edges, [](const auto& e) {
    return std::min(e.from, e.to) < 45 && std::max(e.from, e.to) >= 45;
  });
  world.is_wrong.assign(world.graph.edges.size(), 0);
  for (const std::uint32_t k : {0u, 1u, 2u}) {
    PoseGraphEdge edge = synthetic::measured_edge(world, 30 + k, 60 + k, 0.01, 0.005, rng);
    edge.robust = true;
    synthetic::add_edge(world, edge, false);
  }
  synthetic::add_random_wrong_loops(world, 1, laps, rng);
  world.graph.edges.back().from = 10;
  world.graph.edges.back().to = 80;
  EXPECT_EQ(optimize_with_wrong_loops(world).wrong_kept, 0);
  // Only the wrong one is left, and it starts too far off to be believed.
  PoseGraph loose = world.graph;
  std::erase_if(loose.edges,
                [](const auto& e) { return e.from >= 30 && e.from < 33 && e.to >= 60; });
  const PoseGraphResult result = optimize_pose_graph(loose, {});
  for (const SE3& T : result.T_camera_world) EXPECT_TRUE(T.is_finite());
}

TEST(PoseGraph, PosesThatAreNotFiniteComeBackUnchanged) {
  Rng rng(9);
  PoseGraphWorld world = pose_graph_world({.poses = 30}, rng);
  world.graph.edges[3].T_to_from = SE3(Mat3::Identity(), Vec3(0, std::nan(""), 0));
  const PoseGraphResult result = optimize_pose_graph(world.graph, {});
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.iterations, 0);
  EXPECT_EQ(position_error_m(world, result.T_camera_world),
            position_error_m(world, world.graph.T_camera_world));
  world.graph.edges[3].to = 30;
  EXPECT_THROW((void)optimize_pose_graph(world.graph, {}), InternalError);
}

TEST(PoseGraph, NothingToDoIsDone) {
  EXPECT_TRUE(optimize_pose_graph({}, {}).converged);
  PoseGraph one;
  one.T_camera_world.resize(1);
  EXPECT_TRUE(optimize_pose_graph(one, {}).converged);
}

}  // namespace
}  // namespace ygslam
