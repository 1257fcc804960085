#include "optim/pose_only.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "optim/residual.hpp"
#include "optim/synthetic_views.hpp"

namespace ygslam {
namespace {

using synthetic::Noise;
using synthetic::PoseWorld;

SE3 displaced(const SE3& T, Rng& rng, double translation_m, double rotation) {
  return SE3::exp(synthetic::random_twist(rng, translation_m, rotation)) * T;
}

Vec6 error_of(const PoseSolution& s, const SE3& T_true) {
  return (s.T_camera_world * T_true.inverse()).log();
}

TEST(PoseOnly, RecoversTheExactPoseWithoutNoise) {
  Rng rng(1);
  for (int i = 0; i < 50; ++i) {
    const PoseWorld world = synthetic::pose_world(60, {.pixel_px = 0, .inverse_depth = 0}, rng);
    const auto s = solve_pose(synthetic::camera(), displaced(world.T_camera_world, rng, 0.05, 0.03),
                              world.observations, {});
    ASSERT_TRUE(s);
    EXPECT_EQ(s->inliers, 60);
    EXPECT_LT(error_of(*s, world.T_camera_world).norm(), 1e-9);
    EXPECT_LT(s->rms, 1e-6);
  }
}

TEST(PoseOnly, WithstandsWrongPixelsAndWrongDepths) {
  Rng rng(2);
  const Noise noise = {.wrong_pixel_share = 0.3, .wrong_depth_share = 0.2};
  for (int i = 0; i < 100; ++i) {
    const PoseWorld world = synthetic::pose_world(200, noise, rng);
    const auto s = solve_pose(synthetic::camera(), displaced(world.T_camera_world, rng, 0.04, 0.02),
                              world.observations, {});
    ASSERT_TRUE(s);
    const Vec6 error = error_of(*s, world.T_camera_world);
    EXPECT_LT(error.head<3>().norm(), 0.015);
    EXPECT_LT(error.tail<3>().norm(), 0.005);
    EXPECT_GT(s->inliers, 110);
    EXPECT_LT(s->inliers, 160);
    EXPECT_NEAR(s->rms, 1.0, 0.2);
  }
}

TEST(PoseOnly, WeightZeroTakesNoPart) {
  Rng rng(3);
  PoseWorld world = synthetic::pose_world(80, {.pixel_px = 0, .inverse_depth = 0}, rng);
  for (int i = 0; i < 40; ++i) {
    world.observations[i].seen.ideal_px += Vec2(3, 0);  // a consistent shift, as of a moving thing
    world.observations[i].seen.weight = 0;
  }
  const auto s = solve_pose(synthetic::camera(), world.T_camera_world, world.observations, {});
  ASSERT_TRUE(s);
  EXPECT_EQ(s->inliers, 40);
  EXPECT_LT(error_of(*s, world.T_camera_world).norm(), 1e-9);
}

TEST(PoseOnly, WeightScalesTheInformation) {
  Rng rng(4);
  PoseWorld world = synthetic::pose_world(80, {}, rng);
  const auto full = solve_pose(synthetic::camera(), world.T_camera_world, world.observations, {});
  for (PoseObservation& o : world.observations) o.seen.weight = 0.25;
  const auto quarter =
      solve_pose(synthetic::camera(), world.T_camera_world, world.observations, {});
  ASSERT_TRUE(full && quarter);
  EXPECT_LT(error_of(*quarter, full->T_camera_world).norm(), 1e-7);
  EXPECT_LT((4 * quarter->information - full->information).norm(), 1e-5 * full->information.norm());
}

TEST(PoseOnly, InformationIsThatOfTheInliersJacobians) {
  Rng rng(5);
  const PoseWorld world = synthetic::pose_world(75, {}, rng);
  const Camera camera = synthetic::camera();
  PoseOnlyConfig config;
  config.chi2_depth = HUGE_VAL;  // every depth counts
  const auto s = solve_pose(camera, world.T_camera_world, world.observations, config);
  ASSERT_TRUE(s);
  Mat6 H = Mat6::Zero();
  for (std::size_t i = 0; i < world.observations.size(); ++i) {
    if (!s->inlier[i]) continue;
    const Mat36 J = pose_jacobian(camera, world.observations[i].seen,
                                  s->T_camera_world * world.observations[i].p_world);
    H += J.transpose() * J;
  }
  EXPECT_LT((H - s->information).norm(), 1e-9 * H.norm());
}

// NEES (Bar-Shalom et al. 2001, sec. 5.4): e^T I e is chi2 with 6 degrees of freedom. The gate
// at 95 % trims the residuals a little, hence the loose upper bound.
TEST(PoseOnly, InformationIsConsistentWithTheError) {
  Rng rng(6);
  double nees = 0;
  constexpr int kRuns = 400;
  for (int i = 0; i < kRuns; ++i) {
    const PoseWorld world = synthetic::pose_world(120, {}, rng);
    const auto s = solve_pose(synthetic::camera(), world.T_camera_world, world.observations, {});
    ASSERT_TRUE(s);
    const Vec6 error = error_of(*s, world.T_camera_world);
    nees += error.dot(s->information * error) / kRuns;
  }
  EXPECT_GT(nees, 5.0);
  EXPECT_LT(nees, 8.0);
}

TEST(PoseOnly, WrongDepthsCostNoPixels) {
  Rng rng(7);
  const PoseWorld world =
      synthetic::pose_world(100, {.wrong_depth_share = 1.0, .without_depth_share = 0}, rng);
  const auto s = solve_pose(synthetic::camera(), world.T_camera_world, world.observations, {});
  ASSERT_TRUE(s);
  EXPECT_GT(s->inliers, 85);
  EXPECT_LT(error_of(*s, world.T_camera_world).norm(), 0.05);
}

TEST(PoseOnly, AnExcludedObservationComesBack) {
  // Far from the solution at first, so that the first gates exclude many good points.
  Rng rng(8);
  const PoseWorld world = synthetic::pose_world(100, {.wrong_pixel_share = 0.2}, rng);
  PoseOnlyConfig one_round;
  one_round.rounds = 1;
  one_round.iterations = 2;
  one_round.gate_chi2_pixel = 5.991;
  PoseOnlyConfig more = one_round;
  more.rounds = 6;
  const SE3 T_guess = displaced(world.T_camera_world, rng, 0.4, 0.2);
  const auto early = solve_pose(synthetic::camera(), T_guess, world.observations, one_round);
  const auto late = solve_pose(synthetic::camera(), T_guess, world.observations, more);
  ASSERT_TRUE(late);
  EXPECT_GT(late->inliers, 65);
  EXPECT_GT(late->inliers, early ? early->inliers : 0);
}

TEST(PoseOnly, PointsBehindTheCameraAreOutliers) {
  Rng rng(9);
  PoseWorld world = synthetic::pose_world(60, {}, rng);
  const SE3 T_world_camera = world.T_camera_world.inverse();
  for (int i = 0; i < 20; ++i) {
    const Vec3 p_cam = world.T_camera_world * world.observations[i].p_world;
    world.observations[i].p_world = T_world_camera * Vec3(-p_cam);  // projects to the same pixel
    world.observations[i].seen.depth_m = 0;
  }
  const auto s = solve_pose(synthetic::camera(), world.T_camera_world, world.observations, {});
  ASSERT_TRUE(s);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(s->inlier[i], 0);
  EXPECT_LT(error_of(*s, world.T_camera_world).norm(), 0.05);
}

TEST(PoseOnly, GarbageIsIgnoredOrRefused) {
  Rng rng(10);
  const Camera camera = synthetic::camera();
  PoseWorld world = synthetic::pose_world(60, {}, rng);
  const auto clean =
      solve_pose(camera, world.T_camera_world, std::span(world.observations).subspan(10), {});
  const double nan = std::nan("");
  world.observations[0].p_world.x() = nan;
  world.observations[1].p_world.y() = HUGE_VAL;
  world.observations[2].seen.ideal_px.x() = nan;
  world.observations[3].seen.depth_m = nan;
  world.observations[4].seen.sigma_px = 0;
  world.observations[5].seen.weight = nan;
  world.observations[6].seen.sigma_depth_m = -1;
  world.observations[6].seen.depth_m = 1;
  for (int i = 7; i < 10; ++i) world.observations[i].seen.weight = -1;
  const auto s = solve_pose(camera, world.T_camera_world, world.observations, {});
  ASSERT_TRUE(s && clean);
  EXPECT_LT(error_of(*s, clean->T_camera_world).norm(), 1e-7);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(s->inlier[i], 0);

  EXPECT_FALSE(solve_pose(camera, SE3(Mat3::Identity(), Vec3(nan, 0, 0)), world.observations, {}));
  EXPECT_FALSE(solve_pose(camera, world.T_camera_world, {}, {}));
  EXPECT_FALSE(
      solve_pose(camera, world.T_camera_world, std::span(world.observations).first(12), {}));
}

TEST(PoseOnly, PointsOnALineDoNotBreakIt) {
  Rng rng(11);
  const Camera camera = synthetic::camera();
  std::vector<PoseObservation> line;
  for (int i = 0; i < 30; ++i) {
    const Vec3 p(0.05 * i - 0.7, 0, 2);
    line.push_back({p, synthetic::observe(camera, SE3(), p, {}, rng)});
  }
  const auto s = solve_pose(camera, SE3(), line, {});  // one rotation is undetermined
  ASSERT_TRUE(s);
  EXPECT_TRUE(s->T_camera_world.is_finite());
  EXPECT_LT(s->information.selfadjointView<Eigen::Lower>().eigenvalues()[0], 1.0);
}

}  // namespace
}  // namespace ygslam
