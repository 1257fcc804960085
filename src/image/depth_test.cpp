#include "image/depth.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/rng.hpp"

namespace ygslam {
namespace {

constexpr double kFocal_px = 500;

/// @param inverse_depth_per_m of a pixel counted from the image's centre.
DepthImage surface(const std::function<double(int, int)>& inverse_depth_per_m) {
  DepthImage depth_m(41, 41);
  for (int v = 0; v < 41; ++v) {
    for (int u = 0; u < 41; ++u)
      depth_m.at(u, v) = static_cast<float>(1.0 / inverse_depth_per_m(u - 20, v - 20));
  }
  return depth_m;
}

bool edge_at(const DepthImage& depth_m, double u, double v, double radius_px) {
  return on_depth_edge(depth_m, u, v, depth_at(depth_m, u, v), radius_px);
}

TEST(DepthEdge, NoPlaneHasOneHoweverSteep) {
  for (const double slope : {0.0, 1.0, 3.0, 6.0}) {
    const DepthImage plane =
        surface([&](int u, int v) { return 0.4 * (1.0 + slope * (u - 0.5 * v) / kFocal_px); });
    for (const double radius_px : {3.0, 10.0}) EXPECT_FALSE(edge_at(plane, 20, 20, radius_px));
  }
}

TEST(DepthEdge, IsWhereTwoSurfacesMeetWithinTheRadiusOnEitherSide) {
  const DepthImage step = surface([](int u, int) { return u < 0 ? 1 / 2.0 : 1 / 2.5; });
  for (const int side : {-1, 1}) {
    EXPECT_TRUE(edge_at(step, 20 + 2 * side, 20, 3));
    EXPECT_FALSE(edge_at(step, 20 + 6 * side, 20, 3));
    EXPECT_TRUE(edge_at(step, 20 + 6 * side, 20, 8));
  }
}

TEST(DepthEdge, IsSeenInEveryDirection) {
  for (const auto& [a, b] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
    const DepthImage step =
        surface([a = a, b = b](int u, int v) { return a * u + b * v < 1 ? 1 / 2.0 : 1 / 3.0; });
    EXPECT_TRUE(edge_at(step, 20, 20, 3)) << a << " " << b;
  }
}

TEST(DepthEdge, NeitherHolesNorTheImageBorderMakeOne) {
  DepthImage plane = surface([](int, int) { return 0.5; });
  for (int v = 0; v < 41; ++v) plane.at(22, v) = 0;
  EXPECT_FALSE(edge_at(plane, 20, 20, 2));
  EXPECT_FALSE(edge_at(plane, 0, 40, 5));
}

/// With the noise of a Kinect.
DepthImage noisy(DepthImage depth_m, Rng& rng) {
  for (float& d : depth_m) d += static_cast<float>(kinect_depth_sigma_m(d) * rng.normal());
  return depth_m;
}

TEST(PlaneDepth, IsThatOfAnyPlaneBetweenPixelsToo) {
  constexpr double kHalfUnit_m = 0.0001;
  for (const double slope : {0.0, 1.0, 3.0}) {
    const auto inverse_depth = [&](double u, double v) {
      return 0.4 * (1.0 + slope * (u - 0.5 * v) / kFocal_px);
    };
    DepthImage plane = surface(inverse_depth);
    plane.at(18, 20) = 0;  // a hole
    for (const double shift : {-0.4, 0.0, 0.3})
      EXPECT_NEAR(plane_depth_at(plane, 20 + shift, 20 - shift), 1.0 / inverse_depth(shift, -shift),
                  kHalfUnit_m + 1e-5);
  }
}

TEST(PlaneDepth, IsSeveralTimesMorePreciseThanOnePixel) {
  Rng rng(1);
  const DepthImage plane = surface([](int u, int v) { return 0.4 + 0.001 * u - 0.0005 * v; });
  double one = 0, many = 0;
  int planes = 0;
  constexpr int kTimes = 300;
  for (int i = 0; i < kTimes; ++i) {
    const DepthImage seen = noisy(plane, rng);
    const double depth_m = plane_depth_at(seen, 20, 20);
    if (depth_m == 0) continue;
    ++planes;
    many += (depth_m - 2.5) * (depth_m - 2.5);
    one += (seen.at(20, 20) - 2.5) * (seen.at(20, 20) - 2.5);
  }
  EXPECT_GT(planes, kTimes * 9 / 10);
  EXPECT_LT(std::sqrt(many), std::sqrt(one) / 4);
}

TEST(PlaneDepth, ThereIsNoneWhereSurfacesMeetOrBendOrAreNotSeen) {
  const DepthImage step = surface([](int u, int) { return u < 0 ? 1 / 2.0 : 1 / 2.1; });
  for (const int u : {-4, -1, 0, 1, 4}) EXPECT_EQ(plane_depth_at(step, 20 + u, 20), 0) << u;
  const DepthImage corner = surface([](int u, int) { return 0.5 + 0.002 * std::abs(u); });
  EXPECT_EQ(plane_depth_at(corner, 20, 20), 0);
  DepthImage half = surface([](int, int) { return 0.5; });
  EXPECT_GT(plane_depth_at(half, 20, 20), 0);
  for (int v = 0; v < 41; ++v) std::fill_n(half.row(v), 20, 0.0F);
  EXPECT_EQ(plane_depth_at(half, 20, 20), 0);
  EXPECT_GT(plane_depth_at(half, 26, 20), 0);
  EXPECT_EQ(plane_depth_at(half, 36, 20), 0) << "the image's border";
}

TEST(DepthRange, SpansTheNeighbourhoodAndSkipsHoles) {
  DepthImage depth(20, 20, 2.0F);
  depth.at(12, 10) = 5.0F;
  depth.at(9, 9) = 0.0F;
  depth.at(10, 9) = std::numeric_limits<float>::quiet_NaN();
  const DepthRange range = depth_range(depth, 10, 10, 3);
  EXPECT_EQ(range.min_m, 2.0F);
  EXPECT_EQ(range.max_m, 5.0F);
  EXPECT_EQ(depth_range(depth, 3, 3, 3).max_m, 2.0F);
  EXPECT_EQ(depth_range(depth, 100, 100, 3).max_m, 0.0F);
  EXPECT_EQ(depth_range(depth, -2, 19, 3).max_m, 2.0F);
}

}  // namespace
}  // namespace ygslam
