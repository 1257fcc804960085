#include <algorithm>
#include <cmath>

#include "simulation/surface/painters.hpp"

namespace ygslam::sim {

namespace {

PaintedMaterial plaid(int variant, int size) {
  Rng rng(seed_of(variant, 34));
  const Paint tones[] = {{70, 110, 80}, {150, 50, 50}, {60, 84, 140}, {120, 90, 60}};
  const Paint base = tones[variant % 4];
  const int s = size / 4;
  ColourImage image(s, s, to_rgb(base));
  const int widths[] = {s / 3, s / 12, s / 20};
  for (int v = 0; v < s; ++v) {
    for (int u = 0; u < s; ++u) {
      float k = 1;
      k *= u % s < widths[0] ? 0.62F : 1.0F;
      k *= v % s < widths[0] ? 0.62F : 1.0F;
      const bool line =
          (u > s / 2 && u < s / 2 + widths[1]) || (v > s / 2 && v < s / 2 + widths[1]);
      const bool thin =
          std::abs(u - s * 3 / 4) < widths[2] / 2 || std::abs(v - s * 3 / 4) < widths[2] / 2;
      Paint paint = base * k;
      if (line) paint = Paint{214, 210, 200} * (0.6F + 0.4F * k);
      if (thin) paint = Paint{200, 170, 80} * k;
      image.at(u, v) = to_rgb(paint);
    }
  }
  add_grain(image, s / 4, 2, 0.25F, seed_of(variant, 35));
  return tiled(std::move(image), 0.14F, 0.14F);
}

PaintedMaterial stripes(int variant, int size) {
  Rng rng(seed_of(variant, 36));
  const Paint a = random_paint(rng, 0.6F, 0.55F);
  const Paint b = random_paint(rng, 0.2F, 0.9F);
  const int s = size / 4;
  ColourImage image(s, s, to_rgb(a));
  for (int k = 0; k < 4; ++k) fill_rect(image, 0, k * s / 4, s, k * s / 4 + s / 9, b);
  add_grain(image, s / 4, 2, 0.2F, seed_of(variant, 37));
  return tiled(std::move(image), 0.2F, 0.2F);
}

ColourImage cloth_image(const Paint& base, int size, std::uint64_t seed) {
  const int s = size / 4;
  ColourImage image(s, s, to_rgb(base));
  add_grain(image, s / 2, 1, 0.22F, seed);
  add_grain(image, 3, 4, 0.45F, seed + 5);
  return image;
}

PaintedMaterial jeans(int variant, int size) {
  const Paint tones[] = {{62, 78, 112}, {46, 52, 70}, {96, 114, 146}, {122, 110, 88}};
  return tiled(cloth_image(tones[variant % 4], size, seed_of(variant, 38)), 0.4F, 0.4F);
}

PaintedMaterial cloth(int variant, int size) {
  const Paint tones[] = {{40, 42, 46},  {170, 60, 52},  {66, 96, 136},  {196, 190, 178},
                         {84, 120, 84}, {120, 84, 120}, {190, 150, 70}, {228, 228, 224}};
  PaintedMaterial painted =
      tiled(cloth_image(tones[variant % 8], size, seed_of(variant, 39)), 0.4F, 0.4F);
  if (variant % 8 == 0) painted.material.ir_return = 0.7F;
  return painted;
}

PaintedMaterial print_shirt(int variant, int size) {
  Rng rng(seed_of(variant, 40));
  ColourImage image = cloth_image(random_paint(rng, 0.5F, 0.6F), size, seed_of(variant, 41));
  const int s = image.width();
  const auto place = [&] { return static_cast<int>(rng.below(static_cast<std::uint32_t>(s))); };
  for (int i = 0; i < 20; ++i) {
    const Paint ink = random_paint(rng, 0.7F, 0.9F);
    const int v = place();
    fill_disc(image, place(), v, s / 20, ink);
  }
  return tiled(std::move(image), 0.5F, 0.5F);
}

PaintedMaterial skin(int variant, int size) {
  const Paint tones[] = {
      {222, 172, 146}, {198, 142, 110}, {150, 102, 74}, {108, 72, 54}, {232, 188, 164}};
  const int s = size / 4;
  ColourImage image(s, s, to_rgb(tones[variant % 5]));
  add_grain(image, 6, 4, 0.22F, seed_of(variant, 42));
  PaintedMaterial painted = tiled(std::move(image), 0.3F, 0.3F);
  painted.material.shine = 0.04F;
  return painted;
}

PaintedMaterial hair(int variant, int size) {
  const Paint tones[] = {
      {60, 42, 30}, {28, 24, 22}, {150, 112, 66}, {112, 66, 40}, {140, 136, 130}};
  const int s = size / 4;
  ColourImage image(s, s);
  const ValueNoise strands(64, 5, seed_of(variant, 43));
  for (int v = 0; v < s; ++v) {
    for (int u = 0; u < s; ++u) {
      const float strand = strands.at(static_cast<float>(u) / static_cast<float>(s),
                                      static_cast<float>(v) / static_cast<float>(s));
      image.at(u, v) = to_rgb(tones[variant % 5] * (0.6F + 0.8F * strand));
    }
  }
  PaintedMaterial painted = tiled(std::move(image), 0.2F, 0.2F);
  painted.material.shine = 0.08F;
  painted.material.ir_return = 0.45F;
  return painted;
}

}  // namespace

const PainterTable& people_painters() {
  static const PainterTable table = {{"plaid", plaid}, {"stripes", stripes},   {"jeans", jeans},
                                     {"cloth", cloth}, {"print", print_shirt}, {"skin", skin},
                                     {"hair", hair}};
  return table;
}

}  // namespace ygslam::sim
