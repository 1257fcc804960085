#include "features/feature_grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/rng.hpp"
#include "features/attach.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam {
namespace {

Features random_features(int count, Rng& rng) {
  Features f;
  for (int i = 0; i < count; ++i) {
    Feature p;
    p.uv_px.setZero();
    p.ideal_px = {static_cast<float>(rng.uniform(-60, 700)),
                  static_cast<float>(rng.uniform(-40, 520))};
    p.octave = static_cast<std::uint8_t>(rng.below(8));
    f.points.push_back(p);
    f.descriptors.emplace_back();
  }
  return f;
}

std::vector<std::uint32_t> in_radius(const FeatureGrid& grid, const Eigen::Vector2f& centre_px,
                                     float radius_px, int min_octave = 0, int max_octave = 255) {
  std::vector<std::uint32_t> found;
  grid.in_radius(centre_px, radius_px, min_octave, max_octave, found);
  return found;
}

// The bounds are smaller than the spread of the features: those beyond must be found as well.
TEST(FeatureGrid, FindsWhatBruteForceFinds) {
  Rng rng(1);
  const Features f = random_features(800, rng);
  const FeatureGrid grid(f, {-5, -3, 640, 480});
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Vector2f centre = random_in_box<2>(rng, {-200, -200}, {900, 700}).cast<float>();
    const auto radius = static_cast<float>(rng.uniform(0, 120));
    const int low = static_cast<int>(rng.below(8));
    const int high = static_cast<int>(rng.below(8));
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < f.size(); ++i) {
      const Feature& p = f.points[i];
      if ((p.ideal_px - centre).squaredNorm() <= radius * radius && p.octave >= low &&
          p.octave <= high) {
        expected.push_back(i);
      }
    }
    auto found = in_radius(grid, centre, radius, low, high);
    std::sort(found.begin(), found.end());
    ASSERT_EQ(found, expected);
  }
}

TEST(FeatureGrid, ReusedListHoldsTheLastAnswerOnly) {
  Rng rng(2);
  const Features f = random_features(200, rng);
  const FeatureGrid grid(f, {0, 0, 640, 480});
  std::vector<std::uint32_t> found;
  grid.in_radius({320, 240}, 1000, 0, 7, found);
  EXPECT_EQ(found.size(), 200U);
  grid.in_radius(f.points[7].ideal_px, 0, 0, 7, found);
  EXPECT_EQ(found, std::vector<std::uint32_t>{7});
}

TEST(FeatureGrid, SenselessQueriesFindNothing) {
  Rng rng(3);
  const Features f = random_features(50, rng);
  const FeatureGrid grid(f, {0, 0, 640, 480});
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(in_radius(grid, {nan, 0}, 10).empty());
  EXPECT_TRUE(in_radius(grid, {0, 0}, nan).empty());
  EXPECT_TRUE(in_radius(grid, {0, 0}, -1).empty());
  EXPECT_TRUE(in_radius(grid, {1e30F, 0}, 10).empty());
  EXPECT_TRUE(in_radius({}, {0, 0}, 10).empty());
  EXPECT_TRUE(in_radius({Features{}, {0, 0, 640, 480}}, {0, 0}, 10).empty());
}

TEST(AttachGeometry, UndistortsAndTakesDepthFromTheRecordedPixel) {
  CameraConfig config{.fx = 500, .fy = 510, .cx = 320, .cy = 240, .k1 = 0.2, .k2 = -0.3};
  const Camera camera(config);
  DepthImage depth_m(640, 480, 0.0F);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 300; ++u) depth_m.at(u, v) = 1.0F + 0.001F * static_cast<float>(u);
  }
  Features f;
  Rng rng(4);
  for (int i = 0; i < 100; ++i) {
    Feature p;
    p.ideal_px.setZero();
    p.uv_px = {static_cast<float>(rng.uniform(20, 620)), static_cast<float>(rng.uniform(20, 460))};
    f.points.push_back(p);
    f.descriptors.emplace_back();
  }
  attach_geometry(f, camera, depth_m, PyramidScales(8, 1.2));
  for (const Feature& p : f.points) {
    EXPECT_LT((camera.distort(p.ideal_px.cast<double>()) - p.uv_px.cast<double>()).norm(), 0.01);
    if (p.uv_px.x() < 298) {
      EXPECT_NEAR(p.depth_m, 1.0F + 0.001F * p.uv_px.x(), 0.0025F);
    } else if (p.uv_px.x() > 302) {
      EXPECT_EQ(p.depth_m, 0.0F);
    }
  }
  attach_geometry(f, camera, DepthImage(), PyramidScales(8, 1.2));
  for (const Feature& p : f.points) EXPECT_EQ(p.depth_m, 0.0F);
}

}  // namespace
}  // namespace ygslam
