#include "geometry/triangulation.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

using geometry_test::test_camera;

TEST(Triangulate, FindsThePointWhereTheRaysMeet) {
  const Camera camera = test_camera();
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    Vec6 twist;
    for (int k = 0; k < 6; ++k) twist[k] = rng.normal(0, k < 3 ? 0.4 : 0.1);
    const SE3 T_a_world = SE3::exp(twist.reverse()), T_b_world = SE3::exp(twist) * T_a_world;
    const Vec3 p_world = T_a_world.inverse() * random_in_box<3>(rng, {-1, -1, 2}, {1, 1, 6});
    const Vec3 p_a = T_a_world * p_world, p_b = T_b_world * p_world;
    if (p_b.z() < 0.5) continue;
    const auto found =
        triangulate(camera, T_a_world, camera.project(p_a), T_b_world, camera.project(p_b), 1e-4);
    if (!found) continue;  // too near to the baseline
    EXPECT_LT((*found - p_world).norm(), 1e-5);
  }
}

TEST(Triangulate, RefusesParallelRaysAndPointsBehind) {
  const Camera camera = test_camera();
  const SE3 a, b(Mat3::Identity(), Vec3(-0.2, 0, 0));
  const Vec3 far(0, 0, 50), near(0.1, 0, 2);
  EXPECT_FALSE(triangulate(camera, a, camera.project(far), b, camera.project(b * far), 0.02));
  EXPECT_TRUE(triangulate(camera, a, camera.project(near), b, camera.project(b * near), 0.02));
  // Seen the wrong way round, the rays meet behind the cameras.
  EXPECT_FALSE(triangulate(camera, a, camera.project(b * near), b, camera.project(near), 0.02));
}

}  // namespace
}  // namespace ygslam
