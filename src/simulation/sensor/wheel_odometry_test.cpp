#include "simulation/sensor/wheel_odometry.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "simulation/world/world_config.hpp"

namespace ygslam::sim {
namespace {

CameraPath robot_path(bool closed = true) {
  CameraPathConfig config;
  config.kind = PathKind::kDrive;
  config.jerk = 0;
  config.closed = closed;
  config.waypoints = {{0, 0, 0.6}, {4, 0, 0.6}, {5, 1.5, 0.6},
                      {4, 3, 0.6}, {0, 3, 0.6}, {-1, 1.5, 0.6}};
  return CameraPath(config);
}

WheelOptions perfect() {
  WheelOptions options;
  options.radius_error = options.track_error = options.slip_m = 0;
  return options;
}

TEST(WheelOdometry, PerfectWheelsFollowARobotsPath) {
  const CameraPath path = robot_path();
  const WheelReadings readings = wheel_readings(path, perfect(), {}, 0, 40);
  EXPECT_GT(readings.way_m, 18);
  EXPECT_LT(readings.sideways_m, 1e-4 * readings.way_m);
  // T_odom_base as the truth has it, through the camera's place on the base.
  const SE3 T_world_base = path.T_world_camera(0) * readings.T_base_camera.inverse();
  for (const OdometrySample& sample : readings.samples) {
    const SE3 T_world_camera = path.T_world_camera(static_cast<double>(sample.stamp.ns) * 1e-9);
    const SE3 told = T_world_base * sample.T_odom_base * readings.T_base_camera;
    const SE3 error = T_world_camera.inverse() * told;
    ASSERT_LT(error.t().norm(), 2e-3) << sample.stamp.ns;
    ASSERT_LT(error.angle(), 1e-3) << sample.stamp.ns;
    ASSERT_EQ(sample.T_odom_base.t().z(), 0);
  }
}

TEST(WheelOdometry, ARobotStartsAndEndsStanding) {
  const CameraPath path = robot_path(false);
  const WheelReadings readings = wheel_readings(path, perfect(), {}, 0, 60);
  const auto moved = [&](std::size_t i) {
    return (readings.samples[i].T_odom_base.t() - readings.samples[i - 1].T_odom_base.t()).norm();
  };
  EXPECT_LT(moved(20), 1e-9);
  EXPECT_NEAR(moved(300) * 50, 0.5, 0.01);
  EXPECT_LT(moved(readings.samples.size() - 1), 1e-9);
}

TEST(WheelOdometry, SidewaysMotionIsNotFelt) {
  const Result<WorldConfig> world = load_world("corridor_loop");
  ASSERT_TRUE(world.ok());
  const WheelReadings readings = wheel_readings(CameraPath(world->camera), perfect(), {}, 0, 50);
  EXPECT_GT(readings.sideways_m, 0.03 * readings.way_m);
}

TEST(WheelOdometry, ErrsAsItsOptionsSay) {
  const CameraPath path = robot_path();
  WheelOptions radius = perfect(), slip = perfect(), slips = perfect();
  radius.radius_error = 0.01;
  slip.slip_m = 0.01;
  slips.slips_per_100m = 50;
  double of_radius = 0, of_slip = 0, counted = 0, way = 0;
  constexpr int kRobots = 150;
  // The first 8 seconds are straight: 3 m.
  const auto straight = [&](WheelOptions options, std::uint64_t seed) {
    options.seed = seed;
    return wheel_readings(path, options, {}, 0, 8).samples.back().T_odom_base.t().norm();
  };
  const double truth = straight(perfect(), 1);
  for (std::uint64_t seed = 1; seed <= kRobots; ++seed) {
    of_radius += std::pow(straight(radius, seed) - truth, 2);
    of_slip += std::pow(straight(slip, seed) - truth, 2);
    slips.seed = seed;
    const WheelReadings slipping = wheel_readings(path, slips, {}, 0, 20);
    counted += slipping.slips;
    way += slipping.way_m;
  }
  // The mean of two wheels.
  EXPECT_NEAR(std::sqrt(of_radius / kRobots) / (0.01 * truth / std::sqrt(2)), 1, 0.2);
  EXPECT_NEAR(std::sqrt(of_slip / kRobots) / (0.01 * std::sqrt(truth / 2)), 1, 0.2);
  EXPECT_NEAR(counted / (0.5 * way), 0.9, 0.2);  // none begins within another
}

TEST(WheelOdometry, RepeatsWithOneSeedAndDiffersWithAnother) {
  const CameraPath path = robot_path();
  WheelOptions options;
  const auto first = wheel_readings(path, options, {7}, 0, 10);
  const auto again = wheel_readings(path, options, {7}, 0, 10);
  options.seed = 2;
  const auto other = wheel_readings(path, options, {7}, 0, 10);
  EXPECT_EQ(first.samples.front().stamp.ns, 7);
  EXPECT_EQ(first.samples.back().T_odom_base.t(), again.samples.back().T_odom_base.t());
  EXPECT_NE(first.samples.back().T_odom_base.t(), other.samples.back().T_odom_base.t());
}

}  // namespace
}  // namespace ygslam::sim
