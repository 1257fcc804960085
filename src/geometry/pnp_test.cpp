#include "geometry/pnp.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

using geometry_test::test_camera;

SE3 random_pose(Rng& rng) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = rng.uniform(-1.5, 1.5);
  return SE3::exp(twist);
}

struct World {
  SE3 T_camera_world;
  std::vector<PnpPoint> points;
  std::vector<std::uint8_t> is_right;
};

// Points 0.7 to 5 m away; a wrong match sees another point's pixel and depth.
World random_world(int count, double wrong_share, double depth_share, double noise_px, Rng& rng) {
  World world{random_pose(rng), {}, {}};
  const Camera camera = test_camera();
  const SE3 T_world_camera = world.T_camera_world.inverse();
  for (int i = 0; i < count; ++i) {
    const bool is_right = rng.uniform() >= wrong_share;
    const auto any_point = [&] {
      const double depth_m = rng.uniform(0.7, 5);
      return camera.unproject({rng.uniform(0, 639), rng.uniform(0, 479)}, depth_m);
    };
    const Vec3 p_cam = any_point();
    const Vec3 seen_cam = is_right ? p_cam : any_point();
    PnpPoint p;
    p.p_world = T_world_camera * p_cam;
    p.ideal_px = camera.project(seen_cam) + noise_px * random_normals<2>(rng);
    if (rng.uniform() < depth_share) {
      p.depth_m = 1 / (1 / seen_cam.z() + 0.004 * noise_px * rng.normal());
    }
    world.points.push_back(p);
    world.is_right.push_back(is_right ? 1 : 0);
  }
  return world;
}

TEST(P3p, TheTruePoseIsAmongTheSolutionsAndAllPutPointsOnTheirRays) {
  Rng rng(1);
  int missed = 0;
  for (int run = 0; run < 2000; ++run) {
    const World world = random_world(3, 0, 0, 0, rng);
    std::array<Vec3, 3> rays, p_world;
    for (int i = 0; i < 3; ++i) {
      p_world[i] = world.points[i].p_world;
      rays[i] = (world.T_camera_world * p_world[i]).normalized();
    }
    const P3pSolutions solutions = solve_p3p(rays, p_world);
    double nearest = HUGE_VAL;
    for (int k = 0; k < solutions.count; ++k) {
      const SE3& T = solutions.T_camera_world[k];
      nearest = std::min(nearest, (T * world.T_camera_world.inverse()).log().norm());
      for (int i = 0; i < 3; ++i) EXPECT_GT((T * p_world[i]).normalized().dot(rays[i]), 1 - 1e-9);
    }
    missed += nearest > 1e-5;
  }
  EXPECT_LE(missed, 2);  // nearly double roots
}

TEST(P3p, DegenerateTrianglesHaveNoSolution) {
  const std::array<Vec3, 3> rays = {Vec3(0, 0, 1), Vec3(0.1, 0, 1).normalized(),
                                    Vec3(0.2, 0, 1).normalized()};
  EXPECT_EQ(solve_p3p(rays, {Vec3(0, 0, 2), Vec3(0.2, 0, 2), Vec3(0.4, 0, 2)}).count, 0);
  EXPECT_EQ(solve_p3p(rays, {Vec3(1, 1, 1), Vec3(1, 1, 1), Vec3(1, 1, 1)}).count, 0);
  const Vec3 bad(std::nan(""), 0, 1);
  EXPECT_EQ(solve_p3p(rays, {bad, Vec3(0.2, 0, 2), Vec3(0.4, 1, 2)}).count, 0);
  EXPECT_EQ(solve_p3p({bad, rays[1], rays[2]}, {Vec3(0, 0, 2), Vec3(1, 0, 2), Vec3(0, 1, 2)}).count,
            0);
}

class PnpRansacWithDepthShare : public ::testing::TestWithParam<double> {};

TEST_P(PnpRansacWithDepthShare, FindsThePoseAmongSeventyPercentWrongMatches) {
  Rng rng(2);
  int found = 0;
  for (int run = 0; run < 50; ++run) {
    const World world = random_world(200, 0.7, GetParam(), 1.0, rng);
    const auto result = solve_pnp_ransac(test_camera(), world.points, {}, rng);
    if (!result) continue;
    const Vec6 error = (result->T_camera_world * world.T_camera_world.inverse()).log();
    if (error.head<3>().norm() > 0.03 || error.tail<3>().norm() > 0.02) continue;
    ++found;
    int agree = 0, right = 0;
    for (std::size_t i = 0; i < world.points.size(); ++i) {
      right += world.is_right[i];
      agree += result->inlier[i] & world.is_right[i];
    }
    EXPECT_GT(agree, 0.9 * right);
    EXPECT_LE(result->inliers - agree, 5);
  }
  EXPECT_GE(found, 49);
}

INSTANTIATE_TEST_SUITE_P(Depths, PnpRansacWithDepthShare, ::testing::Values(0.0, 0.5, 0.9, 1.0));

TEST(PnpRansac, SamplesUsedFollowTheShareOfInliers) {
  Rng rng(3);
  const World clean = random_world(100, 0, 0.8, 0.5, rng);
  const World foul = random_world(100, 0.6, 0.8, 0.5, rng);
  const auto few = solve_pnp_ransac(test_camera(), clean.points, {}, rng);
  const auto more = solve_pnp_ransac(test_camera(), foul.points, {}, rng);
  ASSERT_TRUE(few && more);
  EXPECT_LE(few->iterations, 10);
  EXPECT_GT(more->iterations, 30);
  EXPECT_LT(more->iterations, 300);
}

TEST(PnpRansac, WrongMatchesAloneGiveNoPose) {
  Rng rng(4);
  int found = 0;
  for (int run = 0; run < 10; ++run) {
    const World world = random_world(150, 1.0, 0.9, 1.0, rng);
    found += solve_pnp_ransac(test_camera(), world.points, {}, rng).has_value();
  }
  EXPECT_EQ(found, 0);
}

TEST(PnpRansac, SameSeedGivesTheSameBits) {
  Rng rng(5);
  const World world = random_world(150, 0.5, 0.7, 1.0, rng);
  Rng a(7), b(7);
  const auto first = solve_pnp_ransac(test_camera(), world.points, {}, a);
  const auto second = solve_pnp_ransac(test_camera(), world.points, {}, b);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->T_camera_world.R(), second->T_camera_world.R());
  EXPECT_EQ(first->T_camera_world.t(), second->T_camera_world.t());
  EXPECT_EQ(first->inlier, second->inlier);
  EXPECT_EQ(first->iterations, second->iterations);
}

TEST(PnpRansac, GarbageIsIgnoredOrRefused) {
  Rng rng(6);
  World world = random_world(100, 0.2, 0.8, 0.5, rng);
  const double nan = std::nan("");
  for (int i = 0; i < 10; ++i) world.points[i].p_world.x() = i % 2 ? nan : HUGE_VAL;
  for (int i = 10; i < 20; ++i) world.points[i].ideal_px.y() = i % 2 ? nan : -HUGE_VAL;
  for (int i = 20; i < 30; ++i) world.points[i].depth_m = i % 2 ? nan : -1;
  for (int i = 30; i < 40; ++i) world.points[i].p_world *= 1e200;
  const auto result = solve_pnp_ransac(test_camera(), world.points, {}, rng);
  ASSERT_TRUE(result);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(result->inlier[i], 0);
  EXPECT_LT((result->T_camera_world * world.T_camera_world.inverse()).log().norm(), 0.02);

  EXPECT_FALSE(solve_pnp_ransac(test_camera(), {}, {}, rng));
  std::vector<PnpPoint> one_place(50);
  EXPECT_FALSE(solve_pnp_ransac(test_camera(), one_place, {}, rng));
  std::vector<PnpPoint> line(50);
  for (int i = 0; i < 50; ++i) line[i] = {Vec3(0.1 * i, 0, 2), Vec2(10.0 * i, 200), 2.0};
  const auto on_line = solve_pnp_ransac(test_camera(), line, {}, rng);
  EXPECT_TRUE(!on_line || on_line->T_camera_world.is_finite());
}

}  // namespace
}  // namespace ygslam
