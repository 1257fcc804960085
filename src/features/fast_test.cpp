#include "features/fast.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

#include "features/bytes.hpp"
#include "features/features_testing.hpp"

namespace ygslam {
namespace {

// Straight from the definition: the greatest t at which the pixel is still a corner, plus one.
int score_by_trying_thresholds(const PaddedImage& image, int u, int v) {
  static constexpr int kDu[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  static constexpr int kDv[16] = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};
  const auto is_corner = [&](int t) {
    for (const int sign : {1, -1}) {
      int run = 0;
      for (int i = 0; i < 32; ++i) {
        const int ring = image.row(v + kDv[i % 16])[u + kDu[i % 16]];
        run = sign * (ring - image.row(v)[u]) > t ? run + 1 : 0;
        if (run >= 9) return true;
      }
    }
    return false;
  };
  int t = 0;
  while (is_corner(t)) ++t;
  return t;
}

using Row = std::array<std::uint8_t, Bytes::kCount>;

// Of few values, so that equal ones meet; with the ends of the range.
Row random_bytes(Rng& rng) {
  Row row;
  for (auto& x : row) x = static_cast<std::uint8_t>(51 * rng.below(6));
  return row;
}

TEST(Bytes, ComputeAsPlainIntegersDo) {
  Rng rng(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Row a = random_bytes(rng);
    const Row b = random_bytes(rng);
    const Row c = random_bytes(rng);
    const auto expect = [](Bytes result, auto&& plain) {
      Row out;
      result.store(out.data());
      for (std::size_t i = 0; i < out.size(); ++i) ASSERT_EQ(out[i], plain(i)) << i;
    };
    const Bytes x = Bytes::load(a.data());
    const Bytes y = Bytes::load(b.data());
    const Bytes z = Bytes::load(c.data());
    expect(min(x, y), [&](std::size_t i) { return std::min(a[i], b[i]); });
    expect(max(x, y), [&](std::size_t i) { return std::max(a[i], b[i]); });
    expect(excess(x, y), [&](std::size_t i) { return std::max(a[i] - b[i], 0); });
    expect(z.where_greater(x, y), [&](std::size_t i) { return a[i] > b[i] ? c[i] : 0; });
    expect(z.where_at_most(x, y), [&](std::size_t i) { return a[i] <= b[i] ? c[i] : 0; });
  }
}

TEST(Bytes, TellThePlacesOfThoseThatAreNotZero) {
  EXPECT_FALSE(Bytes::zero().any());
  for (const std::uint8_t value : {1, 127, 128, 255}) {
    for (int first = 0; first < Bytes::kCount; ++first) {
      for (int last = first; last < Bytes::kCount; ++last) {
        Row row{};
        row[first] = row[last] = value;
        const Bytes bytes = Bytes::load(row.data());
        EXPECT_TRUE(bytes.any());
        std::vector<int> places;
        bytes.for_each_set([&](int place) { places.push_back(place); });
        EXPECT_EQ(places, first == last ? std::vector{first} : (std::vector{first, last}));
      }
    }
  }
}

TEST(Fast, ScoreIsTheDefinition) {
  // Coarse grey values make arcs of nine likely in random pictures.
  for (const int levels : {2, 3, 6, 256}) {
    GreyImage image = testing::noise_image(40, 40, 3);
    for (auto& p : image) p = static_cast<std::uint8_t>(p * levels / 256 * (255 / (levels - 1)));
    const PaddedImage view = testing::padded(image);
    int corners = 0;
    for (int v = 0; v < 40; ++v) {
      for (int u = 0; u < 40; ++u) {
        const int score = fast_score(view.row(v) + u, view.stride());
        ASSERT_EQ(score, score_by_trying_thresholds(view, u, v)) << u << ' ' << v;
        corners += score > 0;
      }
    }
    EXPECT_GT(corners, 0) << levels;
  }
}

TEST(Fast, RowsEqualSinglePixelsAtEveryThresholdAndLength) {
  const PaddedImage image = testing::padded(testing::DiscWorld(5).view(150, 60));
  for (const int threshold : {0, 1, 7, 20, 60, 254}) {
    for (const int end : {17, 48, 49, 133, 150}) {
      std::vector<std::uint8_t> scores(200);
      for (int v = 0; v < 60; ++v) {
        fast_score_row(image.row(v), image.stride(), 16, end, threshold, scores.data());
        for (int u = 16; u < end; ++u) {
          const int score = fast_score(image.row(v) + u, image.stride());
          ASSERT_EQ(scores[u - 16], score > threshold ? score : 0) << u << ' ' << v;
        }
      }
    }
  }
}

// All local maxima, by the slow way. Of equal neighbours the first in raster order counts.
std::set<std::pair<int, int>> maxima(const PaddedImage& image, int margin, int threshold) {
  const auto score = [&](int u, int v) {
    const int s = fast_score(image.row(v) + u, image.stride());
    return s > threshold ? s : 0;
  };
  std::set<std::pair<int, int>> found;
  for (int v = margin; v < image.height() - margin; ++v) {
    for (int u = margin; u < image.width() - margin; ++u) {
      const int s = score(u, v);
      bool best = s > 0;
      for (int dv = -1; dv <= 1; ++dv) {
        for (int du = -1; du <= 1; ++du) {
          const int other = score(u + du, v + dv);
          const bool before = dv < 0 || (dv == 0 && du < 0);
          if (du != 0 || dv != 0) best = best && (before ? s > other : s >= other);
        }
      }
      if (best) found.emplace(u, v);
    }
  }
  return found;
}

TEST(Fast, DetectsExactlyTheLocalMaxima) {
  for (const int width : {33, 64, 100, 131}) {
    const PaddedImage image = testing::padded(testing::noise_image(width, 50, 8, 60));
    std::vector<Corner> corners;
    FastDetector().detect(image, 6, 35, 12, 12, corners);
    std::set<std::pair<int, int>> found;
    for (const Corner& c : corners) found.emplace(c.u, c.v);
    EXPECT_EQ(found, maxima(image, 6, 12)) << width;
    EXPECT_EQ(found.size(), corners.size());
    EXPECT_GT(found.size(), 5U);
  }
}

TEST(Fast, LowThresholdServesOnlyCellsWithoutStrongCorners) {
  // Left half strong contrast, right half the same at a tenth of it.
  GreyImage image = testing::DiscWorld(9).view(400, 200);
  for (int v = 0; v < 200; ++v) {
    for (int u = 200; u < 400; ++u) {
      image.at(u, v) = static_cast<std::uint8_t>(120 + (image.at(u, v) - 120) / 10);
    }
  }
  const PaddedImage view = testing::padded(image);
  std::vector<Corner> both, high;
  FastDetector().detect(view, 16, 35, 30, 5, both);
  FastDetector().detect(view, 16, 35, 30, 30, high);
  const auto weak_left = std::count_if(both.begin(), both.end(),
                                       [](const Corner& c) { return c.u < 150 && c.score <= 30; });
  const auto right = [](const std::vector<Corner>& corners) {
    return std::count_if(corners.begin(), corners.end(), [](const Corner& c) { return c.u > 240; });
  };
  EXPECT_GT(high.size(), 20U);
  EXPECT_LT(weak_left, static_cast<std::ptrdiff_t>(high.size() / 4));
  EXPECT_EQ(right(high), 0);
  EXPECT_GT(right(both), 10);
}

}  // namespace
}  // namespace ygslam
