#include "geometry/rolling_shutter.hpp"

#include <gtest/gtest.h>

#include "core/rng.hpp"
#include "geometry/geometry_testing.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

CameraConfig rolling_camera(double colour_ms, double depth_ms, double delay_ms) {
  CameraConfig camera = geometry_test::test_camera().config();
  camera.k1 = 0.05;
  camera.colour_readout_ms = colour_ms;
  camera.depth_readout_ms = depth_ms;
  camera.depth_delay_ms = delay_ms;
  return camera;
}

RollingShutter shutter(const CameraConfig& camera, const Vec6& body_velocity) {
  return {camera.height, {shutter_times(camera), body_velocity}};
}

Vec6 random_velocity(Rng& rng) {
  Vec6 velocity;
  for (int i = 0; i < 3; ++i) velocity[i] = rng.normal(0, 0.5);
  for (int i = 3; i < 6; ++i) velocity[i] = rng.normal(0, 1.0);
  return velocity;
}

TEST(RollingShutter, RowsAreReadEvenlyAboutTheMiddle) {
  const RollingShutter rolling = shutter(rolling_camera(24, 48, 5), Vec6::Ones());
  EXPECT_NEAR(rolling.colour_time_s(239.5), 0, 1e-12);
  EXPECT_NEAR(rolling.colour_time_s(479.5) - rolling.colour_time_s(-0.5), 0.024, 1e-12);
  EXPECT_NEAR(rolling.depth_time_s(239.5), 0.005, 1e-12);
  EXPECT_NEAR(rolling.depth_time_s(0) - rolling.depth_time_s(479), -0.048 * 479 / 480, 1e-12);
  const RollingShutter upwards = shutter(rolling_camera(-24, 0, 0), Vec6::Ones());
  EXPECT_GT(upwards.colour_time_s(0), 0);
}

TEST(RollingShutter, BringsAPointOfAnyRowToTheMiddleInstantAndBack) {
  Rng rng(3);
  for (int trial = 0; trial < 200; ++trial) {
    const CameraConfig config = rolling_camera(rng.uniform(-30, 30), 0, 0);
    const Camera camera(config);
    const Vec6 velocity = random_velocity(rng);
    const RollingShutter rolling = shutter(config, velocity);
    const SE3 T_world_middle(so3_exp(Vec3(0.3, -1, 2)), Vec3(1, 2, 3));
    const Vec3 p_middle = random_in_box<3>(rng, {-0.4, -0.3, 0.8}, {0.4, 0.3, 4});
    const Vec3 p_world = T_world_middle * p_middle;
    const Vec2 uv_px = rolling.seen_at(camera, p_middle);
    const double t_s = rolling.colour_time_s(uv_px.y());
    const SE3 T_world_row = T_world_middle * SE3::exp(t_s * velocity);
    const Vec3 p_row = T_world_row.inverse() * p_world;
    EXPECT_LT((camera.distort(camera.project(p_row)) - uv_px).norm(), 0.02);
    EXPECT_LT((rolling.to_middle(p_row, uv_px.y()) - p_middle).norm(), 1e-9);
  }
}

TEST(RollingShutter, GoesAlongTheExponentialMapForAShortTimeAndALongOne) {
  Rng rng(5);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vec6 velocity = 3 * random_velocity(rng);
    const RollingShutter rolling = shutter(rolling_camera(24, 30, -8), velocity);
    const Vec3 p = random_in_box<3>(rng, {-2, -2, 0.3}, {2, 2, 6});
    const double dt_s = rng.uniform(-0.2, 0.2);
    EXPECT_LT((rolling.earlier(p, dt_s) - SE3::exp(dt_s * velocity) * p).norm(), 1e-9);
  }
}

TEST(RollingShutter, AGlobalShutterAndAStandingCameraChangeNothing) {
  const RollingShutter global = shutter(rolling_camera(0, 0, 0), Vec6::Ones());
  const RollingShutter standing = shutter(rolling_camera(26, 30, 4), Vec6::Zero());
  EXPECT_FALSE(global.is_rolling());
  EXPECT_FALSE(standing.is_rolling());
  EXPECT_FALSE(shutter_times(rolling_camera(0, 0, 1)).is_global());
  EXPECT_TRUE(shutter_times(rolling_camera(0, 0, 0)).is_global());
  EXPECT_FALSE(shutter(rolling_camera(26, 26, 0), Vec6::Ones()).depth_has_own_time());
  EXPECT_TRUE(shutter(rolling_camera(26, 26, 1), Vec6::Ones()).depth_has_own_time());
}

}  // namespace
}  // namespace ygslam
