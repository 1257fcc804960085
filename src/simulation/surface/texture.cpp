#include "simulation/surface/texture.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#ifdef __AVX2__
#include <immintrin.h>
#endif

#include "simulation/simd_lanes.hpp"

namespace ygslam::sim {

namespace {

ColourImage halved(const ColourImage& image) {
  const int width = std::max(1, image.width() / 2);
  const int height = std::max(1, image.height() / 2);
  ColourImage half(width, height);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const int u0 = std::min(2 * u, image.width() - 1);
      const int v0 = std::min(2 * v, image.height() - 1);
      const int u1 = std::min(u0 + 1, image.width() - 1);
      const int v1 = std::min(v0 + 1, image.height() - 1);
      const auto mean = [&](auto channel) {
        const int sum = image.at(u0, v0).*channel + image.at(u1, v0).*channel +
                        image.at(u0, v1).*channel + image.at(u1, v1).*channel;
        return static_cast<std::uint8_t>((sum + 2) / 4);
      };
      half.at(u, v) = {mean(&Rgb8::r), mean(&Rgb8::g), mean(&Rgb8::b)};
    }
  }
  return half;
}

/// The eight bytes of two texels that lie side by side.
Floats8 codes(const std::uint32_t* texels) {
#ifdef __AVX2__  // GCC 12 would convert bytes to floats one by one
  const auto* bytes = reinterpret_cast<const __m128i*>(texels);
  return _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(bytes)));
#else
  std::uint8_t bytes[8];
  std::memcpy(bytes, texels, sizeof(bytes));
  Floats8 values;
  for (int k = 0; k < 8; ++k) values[k] = bytes[k];
  return values;
#endif
}

/// The sum of the two halves.
Light folded(Floats8 pair) {
  return __builtin_shufflevector(pair, pair, 0, 1, 2, 3) +
         __builtin_shufflevector(pair, pair, 4, 5, 6, 7);
}

/// Without the library call of std::floor.
int floor_int(float x) {
  const int i = static_cast<int>(x);
  return i - (static_cast<float>(i) > x ? 1 : 0);
}

}  // namespace

Texture::Level Texture::packed(const ColourImage& image) {
  Level level{image.width(), image.height(), {}};
  level.texels.reserve(static_cast<std::size_t>(image.width() + 1) * (image.height() + 1));
  for (int v = 0; v <= image.height(); ++v) {
    for (int u = 0; u <= image.width(); ++u) {
      const Rgb8& p = image.at(u % image.width(), v % image.height());
      level.texels.push_back(
          std::bit_cast<std::uint32_t>(std::array<std::uint8_t, 4>{p.r, p.g, p.b, 0}));
    }
  }
  return level;
}

Texture::Texture(const ColourImage& base) {
  CHECK(!base.empty());
  ColourImage image = base;
  levels_.push_back(packed(image));
  while (image.width() > 1 || image.height() > 1) {
    image = halved(image);
    levels_.push_back(packed(image));
  }
}

Vec3f Texture::mean() const {
  const Light light = bilinear(levels_.back(), 0.5F, 0.5F);
  return {light[0], light[1], light[2]};
}

Light Texture::bilinear(const Level& level, float u, float v) {
  const float x = u * static_cast<float>(level.width) - 0.5F;
  const float y = v * static_cast<float>(level.height) - 0.5F;
  int u0 = floor_int(x);  // -1 .. width - 1
  int v0 = floor_int(y);
  const float a = x - static_cast<float>(u0);
  const float b = y - static_cast<float>(v0);
  u0 += u0 < 0 ? level.width : 0;
  v0 += v0 < 0 ? level.height : 0;
  const int stride = level.width + 1;
  const std::uint32_t* top = level.texels.data() + static_cast<std::ptrdiff_t>(v0) * stride + u0;
  const std::uint32_t* low = top + stride;
  const float left = 1 - a;
  const Floats8 share = {left, left, left, left, a, a, a, a};
  const Light above = folded(share * codes(top));
  const Light below = folded(share * codes(low));
  const Light code = (1 - b) * above + b * below;
  return code * code * (1.0F / (255.0F * 255.0F));
}

Light Texture::sample(float u, float v, float footprint) const {
  u -= std::floor(u);
  v -= std::floor(v);
  // Level and blend from the bits of the number: log2 to within a percent is exact enough here.
  const float clamped = std::max(1.0F, footprint);
  const auto bits = std::bit_cast<std::uint32_t>(clamped);
  const auto last = static_cast<int>(levels_.size()) - 1;
  const int fine = std::min(static_cast<int>(bits >> 23U) - 127, last);
  // Blended only half-way between two levels: elsewhere one look-up will do.
  const float between = static_cast<float>(bits & 0x7fffffU) * 0x1.0p-23F;
  const float blend = std::clamp((between - 0.25F) * 2, 0.0F, 1.0F);
  if (blend >= 1 && fine < last) return bilinear(levels_[fine + 1], u, v);
  const Light sharp = bilinear(levels_[fine], u, v);
  if (fine == last || blend <= 0) return sharp;
  return (1 - blend) * sharp + blend * bilinear(levels_[fine + 1], u, v);
}

}  // namespace ygslam::sim
