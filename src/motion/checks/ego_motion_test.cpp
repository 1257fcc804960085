#include "motion/checks/ego_motion.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "geometry/random_vector.hpp"
#include "motion/motion_test_world.hpp"

namespace ygslam {
namespace {

using motion_test::small_camera;

struct World {
  SE3 T_current_previous = SE3(so3_exp({0.01, 0.02, 0.005}), Vec3(0.03, 0.01, 0.02));
  std::vector<FollowedPoint> points;
  std::vector<std::uint8_t> moving;
  std::vector<std::uint8_t> candidate;
};

/// Fixed points and points that moved by step_m, all with depth.
World make_world(int fixed, int movers, const Vec3& step_m, double noise_px, Rng& rng) {
  const Camera& camera = small_camera();
  World world;
  for (int i = 0; i < fixed + movers; ++i) {
    const bool moves = i >= fixed;
    FollowedPoint p;
    p.previous_px = random_in_box<2>(rng, {10, 10}, {309, 229});
    p.depth_m = rng.uniform(1, 4);
    p.range = {static_cast<float>(p.depth_m), static_cast<float>(p.depth_m)};
    const Vec3 q = world.T_current_previous * camera.unproject(p.previous_px, p.depth_m) +
                   (moves ? step_m : Vec3::Zero());
    p.current_px = camera.project(q) + noise_px * random_normals<2>(rng);
    world.points.push_back(p);
    world.moving.push_back(moves ? 1 : 0);
    world.candidate.push_back(1);
  }
  return world;
}

TEST(EgoMotion, FindsTheCameraMotionAmongMovers) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    const World world = make_world(200, 80, Vec3(0.08, 0.02, 0), 0.2, rng);
    const auto fit = fit_ego_motion(small_camera(), world.points, world.candidate, SE3(), {});
    ASSERT_TRUE(fit) << seed;
    const SE3 error = fit->T_current_previous * world.T_current_previous.inverse();
    EXPECT_LT(error.t().norm(), 0.003) << seed;
    EXPECT_LT(error.angle(), 0.002) << seed;
    for (std::size_t i = 0; i < world.points.size(); ++i) {
      const double r = ego_motion_residual(small_camera(), fit->T_current_previous, world.points[i])
                           .any_depth_px;
      EXPECT_EQ(r > fit->limit_px, world.moving[i] != 0) << r;
    }
  }
}

TEST(EgoMotion, SeesMotionAlongTheEpipolarLine) {
  // The camera moves sideways and so do the movers: every mover stays on its epipolar line.
  Rng rng(3);
  World world = make_world(0, 0, Vec3::Zero(), 0, rng);
  world.T_current_previous = SE3(Mat3::Identity(), Vec3(0.05, 0, 0));
  const Camera& camera = small_camera();
  const FollowedPoint mover = [&] {
    FollowedPoint p;
    p.previous_px = Vec2(120, 90);
    p.depth_m = 2;
    p.range = {1.98F, 2.02F};
    p.current_px = camera.project(world.T_current_previous * camera.unproject(p.previous_px, 2) +
                                  Vec3(0.06, 0, 0));
    return p;
  }();
  EXPECT_GT(ego_motion_residual(camera, world.T_current_previous, mover).any_depth_px, 5);
  FollowedPoint without_depth = mover;
  without_depth.depth_m = 0;
  without_depth.range = {};
  EXPECT_LT(ego_motion_residual(camera, world.T_current_previous, without_depth).any_depth_px, 0.1);
}

TEST(EgoMotion, HoldsInPureRotation) {
  Rng rng(4);
  World world = make_world(150, 0, Vec3::Zero(), 0, rng);
  const SE3 turn(so3_exp({0.0, 0.05, 0.01}), Vec3::Zero());
  for (auto& p : world.points)
    p.current_px =
        small_camera().project(turn * small_camera().unproject(p.previous_px, p.depth_m));
  const auto fit = fit_ego_motion(small_camera(), world.points, world.candidate, SE3(), {});
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->T_current_previous.t().norm(), 1e-3);
  EXPECT_NEAR(fit->T_current_previous.angle(), turn.angle(), 1e-3);
  EXPECT_EQ(fit->inliers, 150);
}

TEST(EgoMotion, OnlyVotersDecide) {
  Rng rng(5);
  World world = make_world(60, 200, Vec3(0.1, 0, 0), 0.1, rng);
  for (std::size_t i = 0; i < world.candidate.size(); ++i)
    world.candidate[i] = world.moving[i] ? 0 : 1;
  const auto fit = fit_ego_motion(small_camera(), world.points, world.candidate, SE3(), {});
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->candidates, 60);
  EXPECT_LT((fit->T_current_previous.t() - world.T_current_previous.t()).norm(), 0.003);
}

TEST(EgoMotion, AtADepthEdgeAnyDepthAroundExcusesThePoint) {
  const Camera& camera = small_camera();
  const SE3 T(Mat3::Identity(), Vec3(0.1, 0, 0));
  FollowedPoint p;
  p.previous_px = Vec2(160, 120);
  p.depth_m = 1;           // what the sensor says
  p.range = {1.0F, 4.0F};  // what there is around
  p.current_px = camera.project(T * camera.unproject(p.previous_px, 4));
  const auto residual = ego_motion_residual(camera, T, p);
  EXPECT_GT(residual.own_depth_px, 10);
  EXPECT_LT(residual.any_depth_px, 1e-6);
}

TEST(EgoMotion, LimitGrowsWithBadMeasurements) {
  Rng rng(6);
  const World good = make_world(200, 0, Vec3::Zero(), 0.1, rng);
  const World bad = make_world(200, 0, Vec3::Zero(), 2.0, rng);
  const auto good_fit = fit_ego_motion(small_camera(), good.points, good.candidate, SE3(), {});
  const auto bad_fit = fit_ego_motion(small_camera(), bad.points, bad.candidate, SE3(), {});
  ASSERT_TRUE(good_fit && bad_fit);
  EXPECT_EQ(good_fit->limit_px, EgoMotionConfig{}.limit_px);
  EXPECT_GT(bad_fit->limit_px, 1.5 * EgoMotionConfig{}.limit_px);
  EXPECT_LE(bad_fit->limit_px, 2 * EgoMotionConfig{}.limit_px);
}

TEST(EgoMotion, BadInputGivesNoFit) {
  Rng rng(7);
  World world = make_world(100, 0, Vec3::Zero(), 0, rng);
  EXPECT_FALSE(
      fit_ego_motion(small_camera(), world.points, std::vector<std::uint8_t>(100, 0), SE3(), {}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  World broken = world;
  for (auto& p : broken.points) p.depth_m = nan;
  EXPECT_FALSE(fit_ego_motion(small_camera(), broken.points, broken.candidate, SE3(), {}));
  for (auto& p : world.points) p.current_px = Vec2(nan, nan);
  EXPECT_FALSE(fit_ego_motion(small_camera(), world.points, world.candidate, SE3(), {}));
  EXPECT_LT(ego_motion_residual(small_camera(), SE3(), world.points[0]).own_depth_px, 0);
  EXPECT_FALSE(fit_ego_motion(small_camera(), {}, {}, SE3(), {}));
  // All in one point: no motion follows from that.
  World one = make_world(1, 0, Vec3::Zero(), 0, rng);
  const std::vector<FollowedPoint> same(50, one.points[0]);
  const auto fit =
      fit_ego_motion(small_camera(), same, std::vector<std::uint8_t>(50, 1), SE3(), {});
  EXPECT_TRUE(!fit || fit->T_current_previous.is_finite());
}

}  // namespace
}  // namespace ygslam
