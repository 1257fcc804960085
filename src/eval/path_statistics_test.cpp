#include "eval/path_statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

// A camera on a circle of radius 1 m, one turn in 10 s, looking along its motion.
std::vector<StampedPose> circle(double rate_hz, double noise_m = 0) {
  Rng rng(3);
  std::vector<StampedPose> poses;
  for (int i = 0; i <= static_cast<int>(10 * rate_hz); ++i) {
    const double t_s = i / rate_hz;
    const double angle = 2 * std::numbers::pi * t_s / 10;
    const Mat3 R = so3_exp({0, 0, angle});
    const Vec3 noise = random_normals<3>(rng, noise_m);
    poses.push_back({{to_ns(5 + t_s)}, SE3(R, Vec3(std::cos(angle), std::sin(angle), 0) + noise)});
  }
  return poses;
}

TEST(PathStatistics, OfACircleAreThoseOfTheFormula) {
  const auto figures = path_statistics(circle(30));
  ASSERT_TRUE(figures.has_value());
  EXPECT_NEAR(figures->duration_s, 10, 1e-9);
  EXPECT_NEAR(figures->length_m, 2 * std::numbers::pi, 1e-3);
  EXPECT_NEAR(figures->speed_mps, 0.2 * std::numbers::pi, 1e-4);
  EXPECT_NEAR(figures->angular_speed_degps, 36, 1e-6);
}

TEST(PathStatistics, DoNotAddUpTheNoiseOfAFastMotionCapture) {
  const auto slow = path_statistics(circle(30, 0.0005));
  const auto fast = path_statistics(circle(300, 0.0005));
  EXPECT_NEAR(fast->length_m, slow->length_m, 0.01);
  EXPECT_NEAR(fast->angular_speed_degps, 36, 1e-6) << "every turn counts once";
}

TEST(PathStatistics, CanBeRestrictedToTheTimeOfTheFrames) {
  const auto poses = circle(100);
  const auto half = path_statistics(poses, {to_ns(7.5)}, {to_ns(12.5)});
  ASSERT_TRUE(half.has_value());
  EXPECT_NEAR(half->duration_s, 5.04, 1e-6) << "the slack of 0.02 s at both ends";
  EXPECT_NEAR(half->speed_mps, 0.2 * std::numbers::pi, 1e-3);
  EXPECT_FALSE(path_statistics(poses, {to_ns(100)}, {to_ns(200)}).has_value());
}

TEST(PathStatistics, NeedTwoPosesAtDifferentTimes) {
  const auto poses = circle(30);
  EXPECT_FALSE(path_statistics({}).has_value());
  EXPECT_FALSE(path_statistics({poses.data(), 1}).has_value());
  EXPECT_TRUE(path_statistics({poses.data(), 2}).has_value());
}

}  // namespace
}  // namespace ygslam
