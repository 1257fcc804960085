#include "inertial/gyro_turn.hpp"

#include <gtest/gtest.h>

#include "inertial/estimator_test_world.hpp"

namespace ygslam {
namespace {

using inertial_world::Drive;

Vec3 turn_error(const GyroTurn& before, const GyroTurn& after, const Mat3& R_before_after) {
  const Mat3 R_after_before = after.R_camera_start * before.R_camera_start.transpose();
  return so3_log(R_after_before * R_before_after);
}

// What is left is the bias that was assumed when the series began: it errs alike all the time.
TEST(GyroTurn, SaysHowTheCameraTurnedUpToABiasThatLasts) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Drive drive({.seed = seed});
    drive.run(3);
    const GyroTurn start = drive.estimator().gyro_turn();
    EXPECT_EQ(start.stamp, drive.now());
    const Mat3 R_start = drive.true_pose().R();
    drive.run(4);
    const GyroTurn half = drive.estimator().gyro_turn();
    const Mat3 R_half = drive.true_pose().R();
    drive.run(4, false);  // nothing need be seen
    const GyroTurn end = drive.estimator().gyro_turn();
    EXPECT_EQ(start.series, end.series);
    const Vec3 first = turn_error(start, half, R_start.transpose() * R_half);
    const Vec3 second = turn_error(half, end, R_half.transpose() * drive.true_pose().R());
    EXPECT_LT(first.norm(), 0.02) << seed;
    EXPECT_NEAR(end.variance_rad2 - half.variance_rad2, half.variance_rad2 - start.variance_rad2,
                0.1 * half.variance_rad2);
    const double std_rad = std::sqrt(3 * (end.variance_rad2 - start.variance_rad2));
    EXPECT_LT((first - second).norm(), 0.5 * first.norm() + 4 * std_rad) << seed;
  }
}

TEST(GyroTurn, WhatDoesNotGoOnIsAnotherSeries) {
  Drive drive({.seed = 7});
  drive.run(3);
  const GyroTurn before = drive.estimator().gyro_turn();
  drive.estimator().disagree();
  drive.run(3);
  EXPECT_NE(drive.estimator().gyro_turn().series, before.series);
}

// Readings are missing for longer than can be guessed: what came before says nothing of what comes
// after, and both are right by themselves.
TEST(GyroTurn, AGapEndsASeries) {
  Drive drive({.seed = 8, .distort = [](const ImuSample& s) {
                 return s.stamp.ns < to_ns(5) || s.stamp.ns > to_ns(5.5);
               }});
  std::uint32_t series = 0;
  for (int part = 0; part < 2; ++part) {
    drive.run(part == 0 ? 2 : 4);  // to 2 s, and over the gap to 8.5 s
    const GyroTurn start = drive.estimator().gyro_turn();
    const Mat3 R_start = drive.true_pose().R();
    ASSERT_EQ(start.stamp, drive.now()) << part;
    drive.run(2.5);
    const GyroTurn end = drive.estimator().gyro_turn();
    ASSERT_EQ(end.series, start.series) << part;
    EXPECT_LT(turn_error(start, end, R_start.transpose() * drive.true_pose().R()).norm(), 0.03);
    EXPECT_TRUE(part == 0 || end.series != series);
    series = end.series;
  }
}

}  // namespace
}  // namespace ygslam
