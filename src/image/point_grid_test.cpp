#include "image/point_grid.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "core/rng.hpp"

namespace ygslam {
namespace {

TEST(PointGrid, TheCellsOfACircleHoldAllOfItsPointsOnceEach) {
  Rng rng(1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Eigen::Vector2f> points = {{nan, 3}, {5, 1e30F}};
  for (int i = 0; i < 300; ++i) {
    const auto y = static_cast<float>(rng.uniform(-90, 400));
    points.emplace_back(static_cast<float>(rng.uniform(-50, 600)), y);
  }
  for (const Eigen::Vector2f& corner :
       {Eigen::Vector2f(0, 0), Eigen::Vector2f(-200, 50), Eigen::Vector2f(1e9F, 1e9F)}) {
    PointGrid grid(20);
    grid.build(points, corner);
    EXPECT_EQ(grid.order().size(), 300U) << "without those that are not finite or absurd";
    for (int trial = 0; trial < 200; ++trial) {
      const auto y = static_cast<float>(rng.uniform(-300, 700));
      const Eigen::Vector2f p(static_cast<float>(rng.uniform(-300, 900)), y);
      const double radius_px = rng.uniform(0, 80);
      std::set<std::uint32_t> found;
      grid.near(p, radius_px, [&](std::uint32_t i) { EXPECT_TRUE(found.insert(i).second); });
      for (std::uint32_t i = 2; i < points.size(); ++i) {
        EXPECT_TRUE(found.contains(i) || (points[i] - p).norm() > radius_px);
        EXPECT_TRUE(!found.contains(i) ||
                    (points[i] - p).cwiseAbs().maxCoeff() <= radius_px + 20.01);
      }
    }
  }
}

TEST(PointGrid, NothingIsNearInAnEmptyOne) {
  PointGrid grid(10);
  grid.near({0, 0}, 100, [](std::uint32_t) { FAIL(); });
  grid.build({});
  grid.near({0, 0}, 100, [](std::uint32_t) { FAIL(); });
}

}  // namespace
}  // namespace ygslam
