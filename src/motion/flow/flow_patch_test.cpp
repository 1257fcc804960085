#include "motion/flow/flow_patch.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/rng.hpp"
#include "geometry/random_vector.hpp"
#include "motion/flow/image_pyramid_levels.hpp"
#include "motion/flow/words16.hpp"
#include "motion/motion_test_world.hpp"

namespace ygslam {
namespace {

using motion_test::texture;

GreyImage textured(int width, int height, double dx, double dy) {
  GreyImage image(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      image.at(u, v) =
          static_cast<std::uint8_t>(texture((u - dx) / 2 + 300, (v - dy) / 2 + 300, 5) + 0.5);
  return image;
}

using Row = std::array<std::int16_t, 16>;

Row random_row(Rng& rng, int limit) {
  Row row;
  for (auto& x : row)
    x = static_cast<std::int16_t>(
        static_cast<int>(rng.below(2 * static_cast<std::uint32_t>(limit) + 1)) - limit);
  return row;
}

TEST(Words, ComputeAsPlainIntegersDo) {
  Rng rng(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Row a = random_row(rng, 16000);
    const Row b = random_row(rng, 16000);
    const Row q15 = random_row(rng, 32767);
    Row out;
    const auto expect = [&](Words result, auto&& plain) {
      result.store(out.data());
      for (std::size_t i = 0; i < 16; ++i) ASSERT_EQ(out[i], plain(i));
    };
    const Words wa = Words::load(a.data());
    const Words wb = Words::load(b.data());
    expect(wa + wb, [&](std::size_t i) { return a[i] + b[i]; });
    expect(wa - wb, [&](std::size_t i) { return a[i] - b[i]; });
    expect(wa.shifted_right(2), [&](std::size_t i) { return a[i] >> 2; });
    expect(wa.magnitude(), [&](std::size_t i) { return std::abs(a[i]); });
    expect(wa.scaled(Words::load(q15.data())), [&](std::size_t i) {
      return static_cast<int>(std::floor(a[i] * static_cast<double>(q15[i]) / 32768.0 + 0.5));
    });
    Sums sums;
    std::int64_t total = 0;
    for (int k = 0; k < 3; ++k) sums.add_products(wa, wb);
    for (std::size_t i = 0; i < 16; ++i) total += 3LL * a[i] * b[i];
    EXPECT_EQ(sums.total(), total);
  }
}

TEST(ImagePyramid, HalvesWithABinomialFilterAndMirrorsTheBorder) {
  const GreyImage image = textured(75, 62, 0, 0);
  const ImagePyramid pyramid(image, 1, 11);
  ASSERT_EQ(pyramid.levels().level.size(), 2U);
  const PaddedImage& coarse = pyramid.levels().level[1];
  ASSERT_EQ(coarse.width(), 38);
  ASSERT_EQ(coarse.height(), 31);
  const auto mirrored = [](int i, int size) {
    i = std::abs(i);
    return i < size ? i : 2 * (size - 1) - i;
  };
  constexpr std::array<int, 5> kWeights{1, 4, 6, 4, 1};
  for (int v = 0; v < coarse.height(); ++v) {
    for (int u = 0; u < coarse.width(); ++u) {
      int sum = 128;
      for (int j = 0; j < 5; ++j)
        for (int i = 0; i < 5; ++i)
          sum += kWeights[i] * kWeights[j] *
                 image.at(mirrored(2 * u + i - 2, 75), mirrored(2 * v + j - 2, 62));
      ASSERT_EQ(coarse.row(v)[u], sum >> 8) << u << " " << v;
    }
  }
  for (int i = 1; i <= coarse.border_px(); ++i) {
    EXPECT_EQ(coarse.row(5)[-i], coarse.row(5)[i]);
    EXPECT_EQ(coarse.row(-i)[3], coarse.row(mirrored(-i, 31))[3]);
    EXPECT_EQ(coarse.row(30 + i)[3], coarse.row(mirrored(30 + i, 31))[3]);
  }
}

/// Newton step by the formulas, in double precision.
Eigen::Vector2d exact_step(const GreyImage& previous, const GreyImage& current,
                           const Eigen::Vector2d& from, const Eigen::Vector2d& to, int half) {
  const auto sample = [](const GreyImage& image, const Eigen::Vector2d& p) {
    const int x = static_cast<int>(std::floor(p.x()));
    const int y = static_cast<int>(std::floor(p.y()));
    return std::lerp(std::lerp<double>(image.at(x, y), image.at(x + 1, y), p.x() - x),
                     std::lerp<double>(image.at(x, y + 1), image.at(x + 1, y + 1), p.x() - x),
                     p.y() - y);
  };
  Eigen::Matrix2d G = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  for (int dv = -half; dv <= half; ++dv) {
    for (int du = -half; du <= half; ++du) {
      Eigen::Vector2d g = Eigen::Vector2d::Zero();
      for (int k = -1; k <= 1; ++k) {
        const double weight = k == 0 ? 10.0 / 32 : 3.0 / 32;
        const Eigen::Vector2d p = from + Eigen::Vector2d(du, dv);
        g.x() += weight * (sample(previous, p + Eigen::Vector2d(1, k)) -
                           sample(previous, p + Eigen::Vector2d(-1, k)));
        g.y() += weight * (sample(previous, p + Eigen::Vector2d(k, 1)) -
                           sample(previous, p + Eigen::Vector2d(k, -1)));
      }
      const Eigen::Vector2d d(du, dv);
      G += g * g.transpose();
      b += g * (sample(current, to + d) - sample(previous, from + d));
    }
  }
  return -G.inverse() * b;
}

class FlowPatchOfSide : public ::testing::TestWithParam<int> {};

TEST_P(FlowPatchOfSide, StepsAsTheFormulasSay) {
  const int side = GetParam();
  const GreyImage previous = textured(160, 140, 0, 0);
  const GreyImage current = textured(160, 140, 0.6, -0.4);
  const ImagePyramid before(previous, 0, side);
  const ImagePyramid after(current, 0, side);
  FlowPatch patch(side);
  // Rounding averages out over the pixels of a patch.
  const double tolerance = side < 11 ? 0.02 : 0.005;
  Rng rng(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector2f from = random_in_box<2>(rng, {40, 40}, {110, 90}).cast<float>();
    const Eigen::Vector2f to = from + Eigen::Vector2f(0.3F, 0.2F);
    patch.take(before.levels().level[0], from);
    const Eigen::Vector2d exact =
        exact_step(previous, current, from.cast<double>(), to.cast<double>(), side / 2);
    const Eigen::Vector2f step = patch.step(after.levels().level[0], to);
    EXPECT_LT((step.cast<double>() - exact).norm(), tolerance * (1 + exact.norm()));
    const auto same = patch.difference(before.levels().level[0], from);
    EXPECT_EQ(same.window, 0);
    EXPECT_EQ(same.centre, 0);
    EXPECT_GT(patch.difference(after.levels().level[0], to).window, 0.1F);
  }
}

INSTANTIATE_TEST_SUITE_P(Sides, FlowPatchOfSide, ::testing::Values(5, 11, 15, 21, 51));

TEST(FlowPatch, HardestContrastsDoNotOverflow) {
  for (const int side : {11, 51}) {
    GreyImage stripes(140, 140);
    GreyImage inverse(140, 140);
    for (int v = 0; v < 140; ++v)
      for (int u = 0; u < 140; ++u) {
        stripes.at(u, v) = ((u / 2) + (v / 2)) % 2 != 0 ? 255 : 0;
        inverse.at(u, v) = static_cast<std::uint8_t>(255 - stripes.at(u, v));
      }
    const ImagePyramid before(stripes, 0, side);
    const ImagePyramid after(inverse, 0, side);
    FlowPatch patch(side);
    const Eigen::Vector2f at(70, 70);
    patch.take(before.levels().level[0], at);
    EXPECT_GT(patch.min_eigenvalue(), 0.1F);
    EXPECT_FLOAT_EQ(patch.difference(after.levels().level[0], at).window, 255.0F);
    const Eigen::Vector2d exact =
        exact_step(stripes, inverse, at.cast<double>(), at.cast<double>(), side / 2);
    EXPECT_LT((patch.step(after.levels().level[0], at).cast<double>() - exact).norm(), 0.02);
  }
}

TEST(FlowPatch, BorderIsReadableWhereverAPatchMayLie) {
  for (const int side : {3, 11, 15, 51}) {
    const ImagePyramid pyramid(textured(60, 50, 0, 0), 0, side);
    const PaddedImage& image = pyramid.levels().level[0];
    FlowPatch patch(side);
    for (const Eigen::Vector2f& at : {Eigen::Vector2f(-1, -1), Eigen::Vector2f(60, 50),
                                      Eigen::Vector2f(-1, 50), Eigen::Vector2f(60, -1)}) {
      ASSERT_TRUE(FlowPatch::is_in_reach(image, at));
      patch.take(image, at);
      EXPECT_EQ(patch.difference(image, at).window, 0);
    }
    EXPECT_FALSE(FlowPatch::is_in_reach(image, {60.5F, 10}));
    EXPECT_FALSE(FlowPatch::is_in_reach(image, {NAN, 10}));
  }
}

}  // namespace
}  // namespace ygslam
