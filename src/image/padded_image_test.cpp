#include "image/padded_image.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "core/rng.hpp"

namespace ygslam {
namespace {

TEST(PaddedImage, BorderMirrorsTheImageHoweverSmall) {
  Rng rng(2);
  PaddedImage p;  // one for all: earlier content must not shine through
  for (const int border_px : {12, 32}) {
    for (const auto& [width, height] : {std::pair{100, 40}, {1, 1}, {2, 5}, {7, 3}, {33, 50}}) {
      GreyImage image(width, height);
      for (std::uint8_t& pixel : image) pixel = static_cast<std::uint8_t>(rng.below(256));
      p.assign(image, border_px);
      ASSERT_EQ(p.border_px(), border_px);
      const auto fold = [](int i, int size) {
        while (i < 0 || i >= size) i = size == 1 ? 0 : (i < 0 ? -i : 2 * (size - 1) - i);
        return i;
      };
      for (int v = -border_px; v < height + border_px; ++v) {
        for (int u = -border_px; u < width + border_px; ++u) {
          ASSERT_EQ(p.row(v)[u], image.at(fold(u, width), fold(v, height))) << u << ' ' << v;
        }
      }
    }
  }
}

}  // namespace
}  // namespace ygslam
