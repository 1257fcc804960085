#include "simulation/texture.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

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

using Bytes4 = std::uint8_t __attribute__((vector_size(4)));
using Floats4 = float __attribute__((vector_size(16)));

Floats4 floats(std::uint32_t texel) {
  return __builtin_convertvector(std::bit_cast<Bytes4>(texel), Floats4);
}

}  // namespace

Texture::Level Texture::packed(const ColourImage& image) {
  Level level{image.width(), image.height(), {}};
  level.texels.reserve(image.size());
  for (const Rgb8& p : image) {
    level.texels.push_back(
        std::bit_cast<std::uint32_t>(std::array<std::uint8_t, 4>{p.r, p.g, p.b, 0}));
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

Light Texture::bilinear(const Level& level, const Vec2f& uv) {
  const float x = (uv.x() - std::floor(uv.x())) * static_cast<float>(level.width) - 0.5F;
  const float y = (uv.y() - std::floor(uv.y())) * static_cast<float>(level.height) - 0.5F;
  const float fx = std::floor(x);
  const float fy = std::floor(y);
  const float a = x - fx;
  const float b = y - fy;
  int u0 = static_cast<int>(fx);  // -1 .. width - 1
  int v0 = static_cast<int>(fy);
  const int u1 = u0 + 1 >= level.width ? 0 : u0 + 1;
  const int v1 = v0 + 1 >= level.height ? 0 : v0 + 1;
  if (u0 < 0) u0 = level.width - 1;
  if (v0 < 0) v0 = level.height - 1;
  const std::uint32_t* top =
      level.texels.data() + static_cast<std::size_t>(v0) * static_cast<std::size_t>(level.width);
  const std::uint32_t* low =
      level.texels.data() + static_cast<std::size_t>(v1) * static_cast<std::size_t>(level.width);
  const Floats4 code = (1 - b) * ((1 - a) * floats(top[u0]) + a * floats(top[u1])) +
                       b * ((1 - a) * floats(low[u0]) + a * floats(low[u1]));
  const Floats4 linear = code * code * (1.0F / (255.0F * 255.0F));
  Light light;
  std::memcpy(light.data(), &linear, sizeof(linear));
  return light;
}

Light Texture::sample(const Vec2f& uv, float footprint) const {
  // Level and blend from the bits of the number: log2 to within a percent is exact enough here.
  const float clamped = std::max(1.0F, footprint);
  const auto bits = std::bit_cast<std::uint32_t>(clamped);
  const auto last = static_cast<int>(levels_.size()) - 1;
  const int fine = std::min(static_cast<int>(bits >> 23U) - 127, last);
  // Blended only half-way between two levels: elsewhere one look-up will do.
  const float between = static_cast<float>(bits & 0x7fffffU) * 0x1.0p-23F;
  const float blend = std::clamp((between - 0.25F) * 2, 0.0F, 1.0F);
  if (blend >= 1 && fine < last) return bilinear(levels_[fine + 1], uv);
  const Light sharp = bilinear(levels_[fine], uv);
  if (fine == last || blend <= 0) return sharp;
  return (1 - blend) * sharp + blend * bilinear(levels_[fine + 1], uv);
}

}  // namespace ygslam::sim
