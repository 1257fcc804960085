#include "geometry/smooth_path.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "core/rng.hpp"

namespace ygslam {
namespace {

constexpr double kFrame_s = 1.0 / 30;
constexpr double kError_m = 0.004;

Vec3 in_a_hand(double t_s) {
  return {0.15 * std::sin(4 * t_s), 0.1 * std::cos(3 * t_s), 0.03 * std::sin(9 * t_s)};
}

std::vector<PathPoint> path_of(int frames, double frame_s) {
  std::vector<PathPoint> path;
  for (int i = 0; i < frames; ++i) path.push_back({i * frame_s, in_a_hand(i * frame_s)});
  return path;
}

double rms_m(std::span<const PathPoint> truth, std::span<const Vec3> points) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    sum += (points[i] - truth[i].p_world).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

TEST(SmoothPath, MotionStaysAndErrorsOfSingleFramesGo) {
  const auto truth = path_of(200, kFrame_s);
  EXPECT_LT(rms_m(truth, smooth_path(truth)), 0.1 * kError_m);
  Rng rng(5);
  auto seen = truth;
  for (PathPoint& point : seen)
    for (int i = 0; i < 3; ++i) point.p_world[i] += rng.normal(0, kError_m);
  EXPECT_LT(rms_m(truth, smooth_path(seen)), 0.7 * kError_m * std::sqrt(3.0));
}

TEST(SmoothPath, NothingLeaksThroughAJumpOrAGap) {
  const auto truth = path_of(100, kFrame_s);
  auto jump = truth;
  for (std::size_t i = 50; i < jump.size(); ++i) jump[i].p_world += Vec3(2, 0, 0);
  EXPECT_LT(rms_m(jump, smooth_path(jump)), 0.1 * kError_m);
  auto gap = truth;
  for (std::size_t i = 50; i < gap.size(); ++i) {
    gap[i].t_s += 0.12;
    gap[i].p_world += Vec3(0.1, 0, 0);
  }
  EXPECT_LT(rms_m(gap, smooth_path(gap)), 0.1 * kError_m);
}

TEST(SmoothPath, TooFewFramesStayAsTheyAre) {
  EXPECT_TRUE(smooth_path({}).empty());
  for (const auto& few : {path_of(7, kFrame_s), path_of(50, 0.1)}) {
    const auto smooth = smooth_path(few);
    for (std::size_t i = 0; i < few.size(); ++i) EXPECT_EQ(smooth[i], few[i].p_world) << i;
  }
}

TEST(SmoothPath, WhatNoCubicFollowsStaysAsItIs) {
  std::vector<PathPoint> shaken;
  for (int i = 0; i < 60; ++i)
    shaken.push_back({i * kFrame_s, Vec3(i % 2 == 0 ? 0.1 : -0.1, 0, 0)});
  EXPECT_EQ(smooth_path(shaken)[30], shaken[30].p_world);
}

}  // namespace
}  // namespace ygslam
