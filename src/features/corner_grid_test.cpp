#include "features/corner_grid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <set>
#include <tuple>
#include <utility>

#include "core/rng.hpp"

namespace ygslam {
namespace {

std::vector<Corner> random_corners(Rng& rng, int count, int width, int height, int scores) {
  std::set<std::pair<int, int>> taken;
  while (static_cast<int>(taken.size()) < count) {
    const auto x = static_cast<int>(rng.below(static_cast<std::uint32_t>(width)));
    taken.emplace(static_cast<int>(rng.below(static_cast<std::uint32_t>(height))), x);
  }
  std::vector<Corner> corners;
  for (const auto& [v, u] : taken) {
    corners.push_back({static_cast<std::int16_t>(u), static_cast<std::int16_t>(v),
                       static_cast<float>(1 + rng.below(static_cast<std::uint32_t>(scores)))});
  }
  return corners;
}

TEST(CornerGrid, FindsTheNearestStrongerAsBruteForceDoes) {
  Rng rng(1);
  for (const int count : {1, 2, 7, 50, 400}) {
    for (const int scores : {1, 3, 1000}) {
      std::vector<Corner> corners = random_corners(rng, count, 90, 50, scores);
      std::ranges::sort(corners, std::greater(), &Corner::score);
      const CornerGrid grid(corners);
      for (const Corner& c : corners) {
        int nearest = 30 * 30;
        for (const Corner& o : corners) {
          const bool stronger = o.score > c.score ||
                                (o.score == c.score && std::tuple(o.v, o.u) < std::tuple(c.v, c.u));
          const int d = (o.u - c.u) * (o.u - c.u) + (o.v - c.v) * (o.v - c.v);
          if (stronger) nearest = std::min(nearest, d);
        }
        ASSERT_EQ(grid.nearest_stronger_px2(c, c.score, 30 * 30), nearest);
      }
    }
  }
}

TEST(CornerGrid, LooksAsFarAsTheLimitUnlessItHasFoundEnough) {
  Rng rng(5);
  std::vector<Corner> corners = random_corners(rng, 60, 640, 480, 1000);
  std::ranges::sort(corners, std::greater(), &Corner::score);
  const CornerGrid grid(corners);
  int far = 0, near = 0;
  for (const Corner& c : corners) {
    const int nearest = grid.nearest_stronger_px2(c, c.score, 1000 * 1000);
    far += nearest > 100 * 100;
    EXPECT_EQ(grid.nearest_stronger_px2(c, c.score, 100 * 100), std::min(nearest, 100 * 100));
    const int with_enough = grid.nearest_stronger_px2(c, c.score, 1000 * 1000, 50 * 50);
    if (nearest > 50 * 50) {
      EXPECT_EQ(with_enough, nearest);
    } else {
      ++near;
      EXPECT_GE(with_enough, nearest);
      EXPECT_LE(with_enough, 50 * 50);
    }
  }
  EXPECT_GT(far, 0);
  EXPECT_GT(near, 0);
}

TEST(CornerGrid, KeepsTheQuotaInRasterOrderAndOnlyGivenCorners) {
  Rng rng(2);
  const std::vector<Corner> corners = random_corners(rng, 600, 300, 200, 500);
  std::set<std::tuple<int, int, float>> given;
  for (const Corner& c : corners) given.emplace(c.v, c.u, c.score);
  for (const int quota : {0, 1, 10, 100, 5000}) {
    const auto chosen = spread_corners(corners, quota, 0.6);
    EXPECT_LE(static_cast<int>(chosen.size()), quota);
    if (quota <= 100) {
      EXPECT_EQ(static_cast<int>(chosen.size()), quota);
    }
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      EXPECT_TRUE(given.contains({chosen[i].v, chosen[i].u, chosen[i].score}));
      if (i > 0) {
        EXPECT_LT(std::tuple(chosen[i - 1].v, chosen[i - 1].u),
                  std::tuple(chosen[i].v, chosen[i].u));
      }
    }
  }
}

TEST(CornerGrid, DoesNotDependOnTheOrderOfItsInput) {
  Rng rng(3);
  std::vector<Corner> corners = random_corners(rng, 500, 200, 200, 20);
  const auto first = spread_corners(corners, 60, 0.6);
  for (std::size_t i = corners.size(); i > 1; --i) {
    std::swap(corners[i - 1], corners[rng.below(static_cast<std::uint32_t>(i))]);
  }
  const auto second = spread_corners(corners, 60, 0.6);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(std::tuple(first[i].u, first[i].v), std::tuple(second[i].u, second[i].v));
  }
}

TEST(CornerGrid, GivesAPoorRegionItsShare) {
  Rng rng(4);
  std::vector<Corner> corners = random_corners(rng, 500, 300, 200, 1000);
  for (Corner& c : corners) c.score = c.u < 150 ? 1000 + 10 * c.score : c.score;
  const auto on_the_right = [](const std::vector<Corner>& chosen) {
    int n = 0;
    for (const Corner& c : chosen) n += c.u >= 150;
    return n;
  };
  EXPECT_EQ(on_the_right(spread_corners(corners, 100, 0.0)), 0);
  EXPECT_GT(on_the_right(spread_corners(corners, 100, 2.0)), 30);
}

}  // namespace
}  // namespace ygslam
