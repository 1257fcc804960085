#include "optim/local_bundle.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <thread>

#include "geometry/random_vector.hpp"
#include "optim/synthetic_views.hpp"

namespace ygslam {
namespace {

using synthetic::BundleWorld;
using synthetic::Noise;

constexpr Noise kExact = {.pixel_px = 0, .inverse_depth = 0};

double worst_pose_error(const BundleResult& r, const std::vector<SE3>& T_true) {
  double worst = 0;
  for (std::size_t i = 0; i < T_true.size(); ++i) {
    worst = std::max(worst, (r.T_camera_world[i] * T_true[i].inverse()).log().norm());
  }
  return worst;
}

double mean_pose_error(const std::vector<SE3>& T, const std::vector<SE3>& T_true) {
  double sum = 0;
  for (std::size_t i = 0; i < T.size(); ++i) sum += (T[i] * T_true[i].inverse()).log().norm();
  return sum / static_cast<double>(T.size());
}

std::vector<SE3> poses_of(const BundleProblem& problem) {
  std::vector<SE3> poses;
  for (const BundlePose& pose : problem.poses) poses.push_back(pose.T_camera_world);
  return poses;
}

void expect_unchanged(const BundleResult& r, const BundleProblem& problem) {
  ASSERT_EQ(r.T_camera_world.size(), problem.poses.size());
  ASSERT_EQ(r.points_world.size(), problem.points_world.size());
  ASSERT_EQ(r.outlier.size(), problem.observations.size());
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    EXPECT_EQ(std::memcmp(&r.T_camera_world[i], &problem.poses[i].T_camera_world, sizeof(SE3)), 0);
  }
  for (std::size_t i = 0; i < problem.points_world.size(); ++i) {
    EXPECT_EQ(std::memcmp(&r.points_world[i], &problem.points_world[i], sizeof(Vec3)), 0);
  }
}

TEST(LocalBundle, FindsTheTruthWithoutNoise) {
  Rng rng(1);
  BundleWorld world = synthetic::bundle_world(8, 150, 5, kExact, rng);
  synthetic::perturb(world.problem, 0.03, 0.02, 0.05, rng);
  const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {});
  ASSERT_TRUE(r.usable);
  EXPECT_LT(worst_pose_error(r, world.T_camera_world), 1e-6);
  for (std::size_t i = 0; i < world.points_world.size(); ++i) {
    EXPECT_LT((r.points_world[i] - world.points_world[i]).norm(), 1e-5);
  }
  EXPECT_LT(r.final_cost, 1e-6 * r.initial_cost);
}

TEST(LocalBundle, ImprovesPosesUnderNoiseAndOutliersAndNamesThem) {
  Rng rng(2);
  const Noise noise = {.wrong_pixel_share = 0.05, .wrong_depth_share = 0.05};
  for (int run = 0; run < 5; ++run) {
    BundleWorld world = synthetic::bundle_world(10, 400, 5, noise, rng);
    const BundleProblem at_truth = world.problem;
    synthetic::perturb(world.problem, 0.02, 0.01, 0.03, rng);
    const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {});
    ASSERT_TRUE(r.usable);
    EXPECT_LT(mean_pose_error(r.T_camera_world, world.T_camera_world),
              0.3 * mean_pose_error(poses_of(world.problem), world.T_camera_world));
    int wrong = 0, found = 0, good = 0, kept = 0;
    for (std::size_t i = 0; i < r.outlier.size(); ++i) {
      const BundleObservation& o = at_truth.observations[i];
      const Vec3 p_cam = world.T_camera_world[o.pose] * world.points_world[o.point];
      const double error_px = (synthetic::camera().project(p_cam) - o.seen.ideal_px).norm();
      (error_px > 10 ? wrong : good) += 1;
      if (error_px > 10) found += r.outlier[i];
      if (error_px <= 10) kept += 1 - r.outlier[i];
    }
    EXPECT_GT(found, 0.95 * wrong);
    EXPECT_GT(kept, 0.9 * good);
  }
}

TEST(LocalBundle, CostNeverGrows) {
  Rng rng(3);
  for (int run = 0; run < 30; ++run) {
    const Noise noise = {.pixel_px = rng.uniform(0.2, 3),
                         .wrong_pixel_share = rng.uniform(0, 0.4),
                         .wrong_depth_share = rng.uniform(0, 0.4),
                         .without_depth_share = rng.uniform(0, 1)};
    BundleWorld world = synthetic::bundle_world(6, 60, 4, noise, rng);
    const Vec3 size = random_in_box<3>(rng, {0, 0, 0}, {0.3, 0.2, 0.5});
    synthetic::perturb(world.problem, size.x(), size.y(), size.z(), rng);
    const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {});
    EXPECT_TRUE(r.usable) << run;  // a step that would raise the cost is not taken
    EXPECT_LE(r.final_cost, r.initial_cost);
    BundleProblem again = world.problem;
    for (std::size_t i = 0; i < again.poses.size(); ++i)
      again.poses[i].T_camera_world = r.T_camera_world[i];
    again.points_world = r.points_world;
    const BundleResult second = adjust_bundle(synthetic::camera(), again, {});
    EXPECT_LE(second.final_cost, r.final_cost * (1 + 1e-9));
  }
}

TEST(LocalBundle, FixedPosesStay) {
  Rng rng(4);
  BundleWorld world = synthetic::bundle_world(6, 100, 4, {}, rng);
  world.problem.poses[2].fixed = world.problem.poses[5].fixed = true;
  synthetic::perturb(world.problem, 0.02, 0.01, 0.02, rng);
  const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {});
  ASSERT_TRUE(r.usable);
  for (const int i : {0, 2, 5}) {
    EXPECT_EQ(r.T_camera_world[i].t(), world.problem.poses[i].T_camera_world.t());
  }
  EXPECT_NE(r.T_camera_world[1].t(), world.problem.poses[1].T_camera_world.t());
}

TEST(LocalBundle, WithoutAFixedPoseTheFirstHoldsTheGauge) {
  Rng rng(5);
  BundleWorld world = synthetic::bundle_world(5, 80, 4, kExact, rng);
  synthetic::perturb(world.problem, 0.02, 0.01, 0.02, rng);
  const BundleResult fixed = adjust_bundle(synthetic::camera(), world.problem, {});
  world.problem.poses[0].fixed = false;
  const BundleResult free = adjust_bundle(synthetic::camera(), world.problem, {});
  ASSERT_TRUE(fixed.usable && free.usable);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(fixed.T_camera_world[i].t(), free.T_camera_world[i].t());
}

TEST(LocalBundle, UndeterminedPointsAndPosesStayAndHurtNobody) {
  Rng rng(6);
  BundleWorld world = synthetic::bundle_world(6, 120, 4, kExact, rng);
  synthetic::perturb(world.problem, 0.01, 0.01, 0.02, rng);
  BundleProblem& problem = world.problem;
  const auto nobody = static_cast<std::uint32_t>(problem.points_world.size());
  problem.points_world.push_back(Vec3(1, 2, 3));  // seen by nobody
  problem.points_world.push_back(Vec3(0.1, 0.2, 3));
  BundleObservation once = {1, nobody + 1, {}};  // one pixel without depth
  once.seen.ideal_px = {300, 200};
  problem.observations.push_back(once);
  problem.poses.push_back({SE3(Mat3::Identity(), Vec3(9, 9, 9)), false});  // sees nothing
  const BundleResult r = adjust_bundle(synthetic::camera(), problem, {});
  ASSERT_TRUE(r.usable);
  EXPECT_EQ(r.points_world[nobody], problem.points_world[nobody]);
  EXPECT_EQ(r.points_world[nobody + 1], problem.points_world[nobody + 1]);
  EXPECT_EQ(r.T_camera_world.back().t(), Vec3(9, 9, 9));
  std::vector<SE3> T_true = world.T_camera_world;
  T_true.push_back(r.T_camera_world.back());
  EXPECT_LT(worst_pose_error(r, T_true), 1e-6);
}

TEST(LocalBundle, PointsLeftOutDoNotHoldThePosesBack) {
  Rng rng(15);
  BundleWorld world = synthetic::bundle_world(4, 60, 4, kExact, rng);
  BundleProblem& problem = world.problem;
  for (std::uint32_t k = 0; k < 300; ++k) {  // each seen once, without depth
    const SE3& T = problem.poses[1 + k % 3].T_camera_world;
    const Vec3 p = synthetic::random_point(synthetic::camera(), T, rng);
    Observation seen;
    seen.ideal_px = synthetic::camera().project(T * p);
    problem.observations.push_back(
        {1 + k % 3, static_cast<std::uint32_t>(problem.points_world.size()), seen});
    problem.points_world.push_back(p);
  }
  for (std::size_t i = 1; i < 4; ++i) {
    SE3& T = problem.poses[i].T_camera_world;
    T = SE3::exp(synthetic::random_twist(rng, 0.02, 0.01)) * T;
  }
  // The single sightings agree with the wrong poses they were placed from.
  for (BundleObservation& o : problem.observations) {
    if (o.point < 60) continue;
    const SE3& T = problem.poses[o.pose].T_camera_world;
    o.seen.ideal_px = synthetic::camera().project(T * problem.points_world[o.point]);
  }
  const BundleResult r = adjust_bundle(synthetic::camera(), problem, {});
  ASSERT_TRUE(r.usable);
  EXPECT_LT(worst_pose_error(r, world.T_camera_world), 1e-6);
}

TEST(LocalBundle, WithAllPosesFixedThePointsAreTriangulated) {
  Rng rng(16);
  BundleWorld world = synthetic::bundle_world(4, 60, 4, kExact, rng);
  for (BundlePose& pose : world.problem.poses) pose.fixed = true;
  synthetic::perturb(world.problem, 0, 0, 0.05, rng);
  const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {});
  ASSERT_TRUE(r.usable);
  std::vector<int> residuals(60, 0);
  for (const BundleObservation& o : world.problem.observations) {
    residuals[o.point] += o.seen.depth_m > 0 ? 3 : 2;
  }
  for (std::size_t k = 0; k < 60; ++k) {
    if (residuals[k] < 3) continue;
    EXPECT_LT((r.points_world[k] - world.points_world[k]).norm(), 1e-5);
  }
}

TEST(LocalBundle, NearlyUndeterminedPointsDoNotBreakIt) {
  Rng rng(7);
  BundleWorld world = synthetic::bundle_world(4, 60, 4, kExact, rng);
  BundleProblem& problem = world.problem;
  // Two pictures without depth from the very same place: the distance is not determined.
  problem.poses.push_back(problem.poses[1]);
  for (int k = 0; k < 40; ++k) {
    const Vec3 p =
        synthetic::random_point(synthetic::camera(), problem.poses[1].T_camera_world, rng);
    const auto point = static_cast<std::uint32_t>(problem.points_world.size());
    problem.points_world.push_back(p);
    for (const std::uint32_t pose : {1u, 4u}) {
      Noise noise = kExact;
      noise.without_depth_share = 1;
      problem.observations.push_back(
          {pose, point,
           synthetic::observe(synthetic::camera(), problem.poses[1].T_camera_world, p, noise,
                              rng)});
    }
  }
  synthetic::perturb(problem, 0.005, 0.005, 0.01, rng);
  const BundleResult r = adjust_bundle(synthetic::camera(), problem, {});
  ASSERT_TRUE(r.usable);
  EXPECT_LT(r.final_cost, 1e-3 * r.initial_cost);
  for (const Vec3& p : r.points_world) EXPECT_TRUE(p.allFinite());
  EXPECT_LT(worst_pose_error(r, world.T_camera_world), 1e-3);
}

TEST(LocalBundle, WhatIsNotFiniteIsRefusedAndTheInputReturned) {
  Rng rng(8);
  const BundleWorld world = synthetic::bundle_world(4, 30, 4, {}, rng);
  const auto refuse = [&](auto&& spoil) {
    BundleProblem problem = world.problem;
    spoil(problem);
    const BundleResult r = adjust_bundle(synthetic::camera(), problem, {});
    EXPECT_FALSE(r.usable);
    expect_unchanged(r, problem);
  };
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    refuse([&](BundleProblem& p) { p.points_world[3].y() = bad; });
    refuse([&](BundleProblem& p) {
      p.poses[2].T_camera_world = SE3(Mat3::Identity(), Vec3(bad, 0, 0));
    });
    refuse([&](BundleProblem& p) { p.observations[5].seen.ideal_px.x() = bad; });
    refuse([&](BundleProblem& p) { p.observations[5].seen.depth_m = bad; });
    refuse([&](BundleProblem& p) { p.observations[5].seen.weight = bad; });
  }
  refuse([&](BundleProblem& p) { p.observations[5].seen.sigma_px = 0; });
  refuse([&](BundleProblem& p) { p.points_world[3] = Vec3(1e300, 1e300, 1); });
}

TEST(LocalBundle, EmptyProblemsAreHarmless) {
  EXPECT_TRUE(adjust_bundle(synthetic::camera(), {}, {}).T_camera_world.empty());
  BundleProblem only_poses;
  only_poses.poses.resize(3);
  EXPECT_EQ(adjust_bundle(synthetic::camera(), only_poses, {}).T_camera_world.size(), 3u);
}

TEST(LocalBundle, PointsBehindTheCameraAreOutliersWithoutGain) {
  Rng rng(9);
  BundleWorld world = synthetic::bundle_world(5, 80, 4, kExact, rng);
  synthetic::perturb(world.problem, 0.01, 0.01, 0.01, rng);
  world.problem.points_world[7] = Vec3(0, 0, -3);
  const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {});
  ASSERT_TRUE(r.usable);
  EXPECT_LT(worst_pose_error(r, world.T_camera_world), 1e-6);
  for (std::size_t i = 0; i < r.outlier.size(); ++i) {
    EXPECT_EQ(r.outlier[i], world.problem.observations[i].point == 7 ? 1 : 0);
  }
}

TEST(LocalBundle, SameInputGivesTheSameBits) {
  Rng rng(10);
  BundleWorld world = synthetic::bundle_world(8, 200, 5, {.wrong_pixel_share = 0.1}, rng);
  synthetic::perturb(world.problem, 0.02, 0.01, 0.02, rng);
  const BundleResult a = adjust_bundle(synthetic::camera(), world.problem, {});
  const BundleResult b = adjust_bundle(synthetic::camera(), world.problem, {});
  for (std::size_t i = 0; i < a.T_camera_world.size(); ++i) {
    EXPECT_EQ(std::memcmp(&a.T_camera_world[i], &b.T_camera_world[i], sizeof(SE3)), 0);
  }
  EXPECT_EQ(a.final_cost, b.final_cost);
  EXPECT_EQ(a.outlier, b.outlier);
}

TEST(LocalBundle, OrderOfObservationsDoesNotMatter) {
  Rng rng(11);
  BundleWorld world = synthetic::bundle_world(6, 100, 4, {.wrong_pixel_share = 0.1}, rng);
  synthetic::perturb(world.problem, 0.02, 0.01, 0.02, rng);
  const BundleResult a = adjust_bundle(synthetic::camera(), world.problem, {});
  auto& o = world.problem.observations;
  for (std::uint32_t i = static_cast<std::uint32_t>(o.size()) - 1; i > 0; --i) {
    std::swap(o[i], o[rng.below(i + 1)]);
  }
  const BundleResult b = adjust_bundle(synthetic::camera(), world.problem, {});
  EXPECT_LT(worst_pose_error(a, b.T_camera_world), 1e-9);
}

TEST(LocalBundle, ManyPosesOfASparseSystem) {
  Rng rng(12);
  BundleWorld world = synthetic::bundle_world(80, 1200, 5, kExact, rng);
  synthetic::perturb(world.problem, 0.005, 0.005, 0.02, rng);
  const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {});
  ASSERT_TRUE(r.usable);
  EXPECT_LT(worst_pose_error(r, world.T_camera_world), 1e-5);
}

TEST(LocalBundle, StoppedAtAnyMomentItIsNoWorseThanItWas) {
  Rng rng(15);
  BundleWorld world = synthetic::room_world(60, 3, 2000, 100, {}, rng);
  synthetic::perturb(world.problem, 0.02, 0.01, 0.02, rng);
  int interrupted = 0;
  for (int delay_us = 0; delay_us < 20'000; delay_us += 1000) {
    std::atomic<bool> abort = false;
    std::jthread other([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(delay_us));
      abort = true;
    });
    const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {}, &abort);
    interrupted += r.interrupted ? 1 : 0;
    ASSERT_TRUE(r.usable);
    EXPECT_LE(r.final_cost, r.initial_cost);
    for (const SE3& T : r.T_camera_world) EXPECT_TRUE(T.is_finite());
  }
  EXPECT_GT(interrupted, 0);
}

TEST(LocalBundle, AbortKeepsWhatWasReached) {
  Rng rng(13);
  BundleWorld world = synthetic::bundle_world(5, 80, 4, {}, rng);
  synthetic::perturb(world.problem, 0.02, 0.01, 0.02, rng);
  const std::atomic<bool> abort = true;
  const BundleResult r = adjust_bundle(synthetic::camera(), world.problem, {}, &abort);
  EXPECT_TRUE(r.interrupted);
  EXPECT_EQ(r.iterations, 0);
  EXPECT_EQ(r.final_cost, r.initial_cost);
  const std::atomic<bool> go_on = false;
  EXPECT_FALSE(adjust_bundle(synthetic::camera(), world.problem, {}, &go_on).interrupted);
}

}  // namespace
}  // namespace ygslam
