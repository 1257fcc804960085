#include "optim/direction.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "core/check.hpp"
#include "geometry/properties_testing.hpp"
#include "optim/local_bundle.hpp"
#include "optim/synthetic_pose_graph.hpp"

namespace ygslam {
namespace {

using synthetic::PoseGraphWorld;

const Vec3 kDown = -Vec3::UnitZ();

MeasuredDirection measured(const SE3& T_camera_world, std::uint32_t pose, double std_rad) {
  return {pose, kDown, T_camera_world.R() * kDown, Mat3::Identity() / (std_rad * std_rad)};
}

/// How far the camera leans, whatever its heading.
double tilt_rad(const SE3& T_camera_world, const SE3& T_true) {
  return (T_camera_world.R().transpose() * (T_true.R() * kDown) - kDown).norm();
}

RC_GTEST_PROP(MeasuredDirectionProperties, JacobianMatchesFiniteDifferences, ()) {
  const SE3 T_camera_world = properties::pose();
  const MeasuredDirection direction = measured(properties::pose(), 0, 0.01);
  const Mat3 J = direction_jacobian(direction, T_camera_world);
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 6; ++i) {
    const SE3 plus = SE3::exp(kStep * Vec6::Unit(i)), minus = plus.inverse();
    const Vec3 slope = (direction_residual(direction, plus * T_camera_world) -
                        direction_residual(direction, minus * T_camera_world)) /
                       (2 * kStep);
    const Vec3 expected = i < 3 ? Vec3::Zero() : Vec3(J.col(i - 3));
    RC_ASSERT((slope - expected).norm() < 1e-6);
  }
}

RC_GTEST_PROP(MeasuredDirectionProperties, EquationsAreTheCostsDerivatives, ()) {
  const SE3 T = properties::pose();
  MeasuredDirection direction = measured(properties::pose(), 0, 0.01);
  direction.information = Vec3(100, 40, 10).asDiagonal();
  Mat6 H = Mat6::Zero();
  Vec6 g = Vec6::Zero();
  add_direction(direction, T, H, g);
  const auto cost = [&](const Vec6& step) {
    const SE3 moved = SE3::exp(step) * T;
    return direction_cost({&direction, 1}, {&moved, 1});
  };
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 6; ++i) {
    const Vec6 step = kStep * Vec6::Unit(i);
    RC_ASSERT(std::abs((cost(step) - cost(-step)) / (2 * kStep) - g[i]) < 1e-4);
    RC_ASSERT(H.row(i).head<3>().norm() == 0);
  }
}

TEST(MeasuredDirection, LeavesAPoseGraphFourDegreesOfFreedom) {
  Rng rng(1);
  PoseGraphWorld world =
      synthetic::pose_graph_world({.poses = 200, .laps = 1, .loops = 0, .odometry_rad = 0.02}, rng);
  const std::vector<SE3> before = world.graph.T_camera_world;
  for (std::uint32_t i = 0; i < before.size(); ++i)
    world.graph.directions.push_back(measured(world.T_camera_world[i], i, 1e-4));
  const PoseGraphResult result = optimize_pose_graph(world.graph, {});
  ASSERT_TRUE(result.converged);
  EXPECT_LT(result.cost, 0.01 * result.initial_cost);
  double worst_before = 0, worst = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    worst_before = std::max(worst_before, tilt_rad(before[i], world.T_camera_world[i]));
    worst = std::max(worst, tilt_rad(result.T_camera_world[i], world.T_camera_world[i]));
  }
  EXPECT_GT(worst_before, 0.02);
  EXPECT_LT(worst, 2e-4);
  // Heading and place are odometry's: turned about the vertical and shifted the world is the same.
  const SE3 T_world_turned(so3_exp(Vec3(0, 0, 0.7)), Vec3(1, 2, 3));
  std::vector<SE3> turned = result.T_camera_world;
  for (SE3& T : turned) T = T * T_world_turned;
  EXPECT_NEAR(direction_cost(world.graph.directions, turned),
              direction_cost(world.graph.directions, result.T_camera_world), 1e-6);
}

TEST(MeasuredDirection, HoldsABundleUpright) {
  Rng rng(2);
  auto world = synthetic::bundle_world(5, 100, 4, {.pixel_px = 3}, rng);
  const auto worst_tilt = [&](double std_rad) {
    BundleProblem problem = world.problem;
    for (std::uint32_t i = 0; i < 5; ++i)
      problem.directions.push_back(measured(world.T_camera_world[i], i, std_rad));
    const BundleResult r = adjust_bundle(synthetic::camera(), problem, {});
    EXPECT_TRUE(r.usable);
    double worst = 0;
    for (std::size_t i = 0; i < 5; ++i)
      worst = std::max(worst, tilt_rad(r.T_camera_world[i], world.T_camera_world[i]));
    return worst;
  };
  EXPECT_GT(worst_tilt(10), 3e-4);
  EXPECT_LT(worst_tilt(1e-5), 2e-5);
}

TEST(MeasuredDirection, WhatIsNoNumberLeavesABundleAsItWas) {
  Rng rng(3);
  auto world = synthetic::bundle_world(4, 50, 4, {}, rng);
  world.problem.directions = {measured(world.T_camera_world[3], 3, 0.01)};
  world.problem.directions[0].direction_camera.x() = std::nan("");
  EXPECT_FALSE(adjust_bundle(synthetic::camera(), world.problem, {}).usable);
}

TEST(MeasuredDirection, OfAPoseThatIsNotThereIsABug) {
  Rng rng(4);
  auto world = synthetic::bundle_world(4, 50, 4, {}, rng);
  world.problem.directions = {measured(SE3(), 4, 0.01)};
  EXPECT_THROW((void)adjust_bundle(synthetic::camera(), world.problem, {}), InternalError);
}

}  // namespace
}  // namespace ygslam
