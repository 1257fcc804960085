// Our optimisers against Ceres on the same problems: the same optimum, to 1e-6.
#ifdef YGSLAM_HAVE_CERES

#include <gtest/gtest.h>

#include "geometry/random_vector.hpp"
#include "optim/local_bundle.hpp"
#include "optim/pose_graph.hpp"
#include "optim/pose_only.hpp"
#include "optim/referee/ceres_referee.hpp"
#include "optim/synthetic_pose_graph.hpp"
#include "optim/synthetic_views.hpp"

namespace ygslam {
namespace {

using synthetic::BundleWorld;
using synthetic::Noise;

BundleConfig to_convergence() {
  BundleConfig config;
  config.iterations_robust = 300;
  config.iterations_refine = 0;
  config.relative_decrease = 0;
  return config;
}

// Leaves out the points with fewer than three residuals, which we hold still and Ceres lets drift.
void keep_determined_points(BundleProblem& problem) {
  std::vector<int> residuals(problem.points_world.size(), 0);
  for (const BundleObservation& o : problem.observations) {
    residuals[o.point] += o.seen.depth_m > 0 ? 3 : 2;
  }
  std::erase_if(problem.observations,
                [&](const BundleObservation& o) { return residuals[o.point] < 3; });
}

void expect_same_optimum(BundleProblem problem, const BundleConfig& config,
                         const referee::Settings& settings) {
  keep_determined_points(problem);
  const BundleResult ours = adjust_bundle(synthetic::camera(), problem, config);
  const auto theirs = referee::adjust_bundle(synthetic::camera(), problem, settings);
  ASSERT_TRUE(ours.usable);
  EXPECT_NEAR(ours.initial_cost, theirs.initial_cost, 1e-9 * theirs.initial_cost);
  EXPECT_NEAR(ours.final_cost, theirs.final_cost, 1e-9 * theirs.final_cost);
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const Vec6 apart = (ours.T_camera_world[i] * theirs.T_camera_world[i].inverse()).log();
    EXPECT_LT(apart.head<3>().norm(), 1e-6) << "pose " << i;
    EXPECT_LT(apart.tail<3>().norm(), 1e-6) << "pose " << i;
  }
}

TEST(CeresAgreement, LocalBundleWithNoise) {
  Rng rng(1);
  for (int run = 0; run < 5; ++run) {
    BundleWorld world = synthetic::bundle_world(6, 120, 4, {}, rng);
    synthetic::perturb(world.problem, 0.02, 0.01, 0.03, rng);
    expect_same_optimum(world.problem, to_convergence(), {});
  }
}

TEST(CeresAgreement, LocalBundleWithTheHuberKernelAtWork) {
  Rng rng(2);
  const Noise noise = {.wrong_pixel_share = 0.05, .wrong_depth_share = 0.1};
  for (int run = 0; run < 5; ++run) {
    BundleWorld world = synthetic::bundle_world(6, 120, 4, noise, rng);
    synthetic::perturb(world.problem, 0.01, 0.005, 0.01, rng);
    for (BundleObservation& o : world.problem.observations) o.seen.weight = rng.uniform(0.3, 1);
    expect_same_optimum(world.problem, to_convergence(), {});
  }
}

TEST(CeresAgreement, LocalBundleWithTheTailOfStudentsT) {
  Rng rng(8);
  BundleConfig config = to_convergence();
  config.iterations_refine = 300;
  config.gate_chi2_pixel = config.chi2_depth = HUGE_VAL;
  referee::Settings settings;
  settings.chi2_depth = HUGE_VAL;
  settings.tail_dof = config.tail_dof;
  for (int run = 0; run < 5; ++run) {
    BundleWorld world = synthetic::bundle_world(6, 120, 4, {.wrong_pixel_share = 0.02}, rng);
    synthetic::perturb(world.problem, 0.002, 0.001, 0.002, rng);
    expect_same_optimum(world.problem, config, settings);
  }
}

TEST(CeresAgreement, LocalBundleWithSeveralFixedPosesAndTheSparseSolver) {
  Rng rng(3);
  BundleWorld world = synthetic::bundle_world(70, 700, 5, {}, rng);
  world.problem.poses[30].fixed = world.problem.poses[69].fixed = true;
  synthetic::perturb(world.problem, 0.005, 0.003, 0.01, rng);
  expect_same_optimum(world.problem, to_convergence(), {});
}

TEST(CeresAgreement, LocalBundleWithPointsSeenTwiceInOneImage) {
  Rng rng(6);
  BundleWorld world = synthetic::bundle_world(5, 80, 4, {}, rng);
  auto& observations = world.problem.observations;
  for (std::size_t i = 0, n = observations.size(); i < n; i += 3) {
    observations.push_back(observations[i]);
    observations.back().seen.ideal_px += random_normals<2>(rng);
  }
  synthetic::perturb(world.problem, 0.01, 0.005, 0.01, rng);
  expect_same_optimum(world.problem, to_convergence(), {});
}

std::vector<MeasuredDirection> disturbed_directions(const std::vector<SE3>& T_camera_world,
                                                    double std_rad, Rng& rng) {
  std::vector<MeasuredDirection> directions;
  for (std::uint32_t i = 0; i < T_camera_world.size(); ++i) {
    const Vec3 seen = T_camera_world[i].R() * Vec3::UnitY() + std_rad * random_normals<3>(rng);
    const Vec3 variances(std_rad * std_rad, 2 * std_rad * std_rad, 4 * std_rad * std_rad);
    directions.push_back(
        {i, Vec3::UnitY(), seen.normalized(), Mat3(variances.cwiseInverse().asDiagonal())});
  }
  return directions;
}

TEST(CeresAgreement, LocalBundleWithMeasuredDirections) {
  Rng rng(9);
  for (int run = 0; run < 5; ++run) {
    BundleWorld world = synthetic::bundle_world(6, 120, 4, {}, rng);
    world.problem.directions = disturbed_directions(world.T_camera_world, 0.002, rng);
    synthetic::perturb(world.problem, 0.02, 0.01, 0.03, rng);
    expect_same_optimum(world.problem, to_convergence(), {});
  }
}

TEST(CeresAgreement, WholeMapWithAllPosesButTheFirstFree) {
  Rng rng(7);
  BundleWorld world = synthetic::room_world(120, 3, 3000, 100, {}, rng);
  ASSERT_GT(world.problem.observations.size(), 8000u);
  synthetic::perturb(world.problem, 0.01, 0.005, 0.02, rng);
  expect_same_optimum(world.problem, to_convergence(), {});
}

TEST(CeresAgreement, PoseOnlyWithoutKernel) {
  Rng rng(4);
  PoseOnlyConfig config;
  config.rounds = 1;
  config.robust_rounds = 0;
  config.tail_dof = HUGE_VAL;
  config.iterations = 50;
  for (int run = 0; run < 20; ++run) {
    const auto world = synthetic::pose_world(100, {}, rng);
    const SE3 T_guess = SE3::exp(synthetic::random_twist(rng, 0.02, 0.01)) * world.T_camera_world;
    const auto ours = solve_pose(synthetic::camera(), T_guess, world.observations, config);
    ASSERT_TRUE(ours);
    referee::Settings settings;
    settings.chi2_pixel = settings.chi2_depth = HUGE_VAL;
    const auto theirs =
        referee::solve_pose(synthetic::camera(), T_guess, world.observations, settings);
    EXPECT_LT((ours->T_camera_world * theirs.T_camera_world[0].inverse()).log().norm(), 1e-6);
  }
}

TEST(CeresAgreement, PoseOnlyWithTheHuberKernelAtWork) {
  Rng rng(5);
  PoseOnlyConfig config;
  config.rounds = config.robust_rounds = 1;
  config.iterations = 200;
  for (int run = 0; run < 20; ++run) {
    const auto world =
        synthetic::pose_world(100, {.wrong_pixel_share = 0.15, .wrong_depth_share = 0.1}, rng);
    const SE3 T_guess = SE3::exp(synthetic::random_twist(rng, 0.02, 0.01)) * world.T_camera_world;
    const auto ours = solve_pose(synthetic::camera(), T_guess, world.observations, config);
    const auto theirs = referee::solve_pose(synthetic::camera(), T_guess, world.observations, {});
    ASSERT_TRUE(ours);
    EXPECT_LT((ours->T_camera_world * theirs.T_camera_world[0].inverse()).log().norm(), 1e-6);
  }
}

TEST(CeresAgreement, PoseGraphsOf300Poses) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Rng rng(seed);
    const synthetic::Laps laps = {.neighbours = static_cast<int>(seed % 3) + 1, .loops = 60};
    auto world = synthetic::pose_graph_world(laps, rng);
    for (PoseGraphEdge& edge : world.graph.edges) {
      edge.information = 0.1 * synthetic::random_information(rng);
    }
    if (seed == 3) world.graph.fixed[150] = 1;
    if (seed > 3) world.graph.directions = disturbed_directions(world.T_camera_world, 0.002, rng);
    const PoseGraphResult ours = optimize_pose_graph(world.graph, {.gnc = false});
    const referee::Solution theirs = referee::optimize_pose_graph(world.graph, {});
    EXPECT_TRUE(ours.converged);
    EXPECT_NEAR(ours.initial_cost, theirs.initial_cost, 1e-9 * theirs.initial_cost);
    EXPECT_NEAR(ours.cost, theirs.final_cost, 1e-6 * theirs.final_cost);
    for (std::size_t i = 0; i < ours.T_camera_world.size(); ++i) {
      EXPECT_LT((ours.T_camera_world[i] * theirs.T_camera_world[i].inverse()).log().norm(), 1e-4);
    }
  }
}

}  // namespace
}  // namespace ygslam

#endif  // YGSLAM_HAVE_CERES
