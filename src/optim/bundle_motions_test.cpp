// Bundle adjustment with motions that something else than the camera has measured.
#include <gtest/gtest.h>

#include "optim/local_bundle.hpp"
#include "optim/synthetic_views.hpp"

namespace ygslam {
namespace {

using synthetic::BundleWorld;
using synthetic::Noise;

Mat6 information(double std_m, double std_rad) {
  Vec6 diagonal;
  diagonal << Vec3::Constant(1 / (std_m * std_m)), Vec3::Constant(1 / (std_rad * std_rad));
  return diagonal.asDiagonal();
}

SE3 between(const std::vector<SE3>& T_camera_world, std::uint32_t from, std::uint32_t to) {
  return T_camera_world[to] * T_camera_world[from].inverse();
}

void forget_observations_of(BundleProblem& problem, std::uint32_t pose) {
  std::erase_if(problem.observations,
                [pose](const BundleObservation& o) { return o.pose == pose; });
}

TEST(BundleMotions, WithoutPointsTheyAreAPoseGraph) {
  Rng rng(1);
  PoseGraph graph;
  for (int i = 0; i < 6; ++i)
    graph.T_camera_world.push_back(SE3::exp(synthetic::random_twist(rng, 1, 0.5)));
  graph.fixed = {1, 0, 0, 0, 0, 0};
  const auto add = [&](std::uint32_t from, std::uint32_t to) {
    const SE3 error = SE3::exp(synthetic::random_twist(rng, 0.05, 0.03));
    const double sigma_rad = rng.uniform(0.01, 0.1);
    graph.edges.push_back({from, to, error * between(graph.T_camera_world, from, to),
                           information(rng.uniform(0.01, 0.1), sigma_rad)});
  };
  for (std::uint32_t i = 0; i + 1 < 6; ++i) add(i, i + 1);
  add(4, 1);
  add(5, 0);
  BundleProblem problem;
  for (std::size_t i = 0; i < 6; ++i)
    problem.poses.push_back({graph.T_camera_world[i], graph.fixed[i] != 0});
  problem.motions = graph.edges;
  const BundleResult bundle = adjust_bundle(synthetic::camera(), problem,
                                            {.iterations_refine = 30, .relative_decrease = 1e-12});
  const PoseGraphResult referee = optimize_pose_graph(graph, {});
  ASSERT_TRUE(bundle.usable);
  EXPECT_NEAR(bundle.final_cost, referee.cost, 1e-6 * referee.cost);
  EXPECT_GT(bundle.initial_cost, 1.5 * bundle.final_cost);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT((bundle.T_camera_world[i] * referee.T_camera_world[i].inverse()).log().norm(), 1e-5);
}

// Nobody else sees what the last camera sees: it is where the motion led.
TEST(BundleMotions, PlaceAPoseThatNoPointHolds) {
  Rng rng(2);
  BundleWorld world = synthetic::bundle_world(6, 200, 4, {.pixel_px = 0, .inverse_depth = 0}, rng);
  forget_observations_of(world.problem, 5);
  world.problem.motions = {{3, 5, between(world.T_camera_world, 3, 5), information(0.02, 0.003)}};
  synthetic::perturb(world.problem, 0.03, 0.02, 0.05, rng);
  const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {});
  ASSERT_TRUE(r.usable);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_LT((r.T_camera_world[i] * world.T_camera_world[i].inverse()).log().norm(), 1e-5) << i;
}

TEST(BundleMotions, TheCostIsLeastAtTheEnd) {
  Rng rng(3);
  const Noise noise{.pixel_px = 1};
  BundleWorld world = synthetic::bundle_world(5, 80, 4, noise, rng);
  const auto add = [&](std::uint32_t from, std::uint32_t to) {
    const SE3 error = SE3::exp(synthetic::random_twist(rng, 0.02, 0.01));
    world.problem.motions.push_back(
        {from, to, error * between(world.T_camera_world, from, to), information(0.01, 0.004)});
  };
  add(4, 1);
  add(2, 3);
  add(0, 4);
  const BundleConfig config{
      .iterations_robust = 40, .iterations_refine = 0, .relative_decrease = 1e-13};
  const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, config);
  ASSERT_TRUE(r.usable);
  BundleProblem at_end = world.problem;
  for (std::size_t i = 0; i < 5; ++i) at_end.poses[i].T_camera_world = r.T_camera_world[i];
  at_end.points_world = r.points_world;
  const BundleConfig no_steps{.iterations_robust = 0, .iterations_refine = 0};
  const auto cost = [&](std::size_t pose, int axis, double step) {
    BundleProblem moved = at_end;
    Vec6 twist = Vec6::Zero();
    twist[axis] = step;
    moved.poses[pose].T_camera_world = SE3::exp(twist) * moved.poses[pose].T_camera_world;
    return adjust_bundle(synthetic::camera(), moved, no_steps).initial_cost;
  };
  constexpr double kStep = 1e-5;
  for (std::size_t pose = 1; pose < 5; ++pose) {
    for (int axis = 0; axis < 6; ++axis) {
      const double up = cost(pose, axis, kStep), down = cost(pose, axis, -kStep);
      const double slope = (up - down) / (2 * kStep);
      const double curvature = (up + down - 2 * r.final_cost) / (kStep * kStep);
      EXPECT_GT(curvature, 0);
      EXPECT_LT(std::abs(slope / curvature), 1e-6) << "the optimum lies farther, in m or rad";
    }
  }
}

TEST(BundleMotions, WhatPointsSayAgainstThemIsWeighed) {
  Rng rng(4);
  BundleWorld world = synthetic::bundle_world(4, 150, 4, {.pixel_px = 0.5}, rng);
  const SE3 wrong(so3_exp({0, 0.05, 0}), {0.1, 0, 0});
  const auto moved_by = [&](double std_m) {
    BundleProblem problem = world.problem;
    problem.motions = {
        {0, 3, wrong * between(world.T_camera_world, 0, 3), information(std_m, 0.3 * std_m)}};
    const BundleResult r = adjust_bundle(synthetic::camera(), problem, {});
    EXPECT_TRUE(r.usable);
    return (r.T_camera_world[3] * world.T_camera_world[3].inverse()).log().norm();
  };
  EXPECT_LT(moved_by(0.3), 0.01) << "150 points know better";
  EXPECT_GT(moved_by(1e-5), 0.05);
}

TEST(BundleMotions, WhatIsNoNumberLeavesAllAsItWas) {
  Rng rng(5);
  BundleWorld world = synthetic::bundle_world(4, 50, 4, {}, rng);
  world.problem.motions = {{0, 3, SE3(), std::nan("") * Mat6::Identity()}};
  const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {});
  EXPECT_FALSE(r.usable);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(r.T_camera_world[i].t(), world.problem.poses[i].T_camera_world.t());
}

}  // namespace
}  // namespace ygslam
