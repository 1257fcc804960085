#include "features/scale_space.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "features/features_testing.hpp"

namespace ygslam {
namespace {

TEST(Reduce, EqualsBilinearInterpolationAtTheScaledPixel) {
  const PaddedImage source = testing::padded(testing::noise_image(131, 90, 3));
  for (const double ratio : {1.05, 1.2, 1.5, 1.99}) {
    const int width = static_cast<int>(130 / ratio) + 1;
    const int height = static_cast<int>(89 / ratio) + 1;
    PaddedImage target;
    reduce(source, ratio, width, height, target);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        const double x = u * ratio;
        const double y = v * ratio;
        const int x0 = static_cast<int>(x);
        const int y0 = static_cast<int>(y);
        const auto along = [&](int row) {
          const std::uint8_t* const p = source.row(row) + x0;
          return p[0] + (x - x0) * (p[1] - p[0]);
        };
        const double expected = along(y0) + (y - y0) * (along(y0 + 1) - along(y0));
        // Weights in 1/64 (up to 2 grey values each way at full contrast) and two roundings.
        ASSERT_NEAR(target.row(v)[u], expected, 5.0) << u << ' ' << v;
      }
    }
  }
}

TEST(Reduce, KeepsUniformImagesAndRamps) {
  GreyImage image(200, 60);
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 200; ++u) image.at(u, v) = static_cast<std::uint8_t>(u);
  }
  PaddedImage target;
  reduce(testing::padded(image), 1.2, 150, 49, target);
  for (int u = 0; u < 150; ++u) ASSERT_NEAR(target.row(20)[u], 1.2 * u, 0.51);
  reduce(testing::padded(GreyImage(200, 60, 255)), 1.2, 166, 50, target);
  for (int u = 0; u < 166; ++u) ASSERT_EQ(target.row(49)[u], 255);
}

TEST(Blur, EqualsTheGaussian) {
  const PaddedImage source = testing::padded(testing::noise_image(70, 50, 4));
  PaddedImage target;
  blur_7x7(source, target);
  double weights[7];
  double total = 0;
  for (int i = 0; i < 7; ++i) total += weights[i] = std::exp(-0.5 * (i - 3) * (i - 3) / 4.0);
  for (int v = -8; v < 58; ++v) {
    for (int u = -8; u < 78; ++u) {
      double expected = 0;
      for (int dv = -3; dv <= 3; ++dv) {
        for (int du = -3; du <= 3; ++du) {
          expected += weights[dv + 3] * weights[du + 3] * source.row(v + dv)[u + du];
        }
      }
      ASSERT_NEAR(target.row(v)[u], expected / (total * total), 1.6) << u << ' ' << v;
    }
  }
}

}  // namespace
}  // namespace ygslam
