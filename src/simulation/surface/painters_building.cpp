#include <algorithm>
#include <cmath>

#include "simulation/surface/painters.hpp"

namespace ygslam::sim {

namespace {

ColourImage wood_image(int width, int height, const Paint& base, std::uint64_t seed) {
  ColourImage image(width, height);
  const FractalNoise bends(3, 3, seed);
  const ValueNoise rings(2, 28, seed + 9);
  const ValueNoise pores(12, 120, seed + 17);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const float x = static_cast<float>(u) / static_cast<float>(width);
      const float y = static_cast<float>(v) / static_cast<float>(height);
      const float bend = bends.at(x, y);
      const float ring = rings.at(x, y + 0.12F * bend);
      const float pore = pores.at(x, y);
      image.at(u, v) = to_rgb(base * (0.82F + 0.22F * ring + 0.10F * pore));
    }
  }
  return image;
}

PaintedMaterial white(int /*variant*/, int /*size*/) {
  ColourImage image(64, 64, to_rgb({250, 250, 250}));
  add_grain(image, 8, 3, 0.06F, 11);
  return tiled(std::move(image), 0.3F, 0.3F);
}

PaintedMaterial plaster(int variant, int size) {
  Rng rng(seed_of(variant, 2));
  const float warm = static_cast<float>(rng.uniform(0, 18));
  ColourImage image(size, size, to_rgb({222, 220 - warm / 3, 214 - warm}));
  add_grain(image, 5, 3, 0.08F, seed_of(variant, 3));
  add_grain(image, size / 8, 2, 0.05F, seed_of(variant, 4));
  for (int i = 0; i < 26; ++i) {  // scuffs and small marks of use
    const int u = static_cast<int>(rng.below(static_cast<std::uint32_t>(size)));
    const int v = static_cast<int>(rng.below(static_cast<std::uint32_t>(size)));
    const int w = 2 + static_cast<int>(rng.below(9));
    const Paint mark = Paint{170, 165, 158} * static_cast<float>(rng.uniform(0.7, 1.1));
    fill_rect(image, u, v, u + w, v + 1 + static_cast<int>(rng.below(3)), mark);
  }
  return tiled(std::move(image), 2.6F, 2.6F);
}

PaintedMaterial carpet(int variant, int size) {
  Rng rng(seed_of(variant, 5));
  const Paint base = variant % 2 == 0 ? Paint{118, 122, 130} : Paint{96, 104, 118};
  ColourImage image(size, size, to_rgb(base));
  add_grain(image, size / 4, 2, 0.35F, seed_of(variant, 6));
  add_grain(image, 6, 4, 0.30F, seed_of(variant, 7));
  for (int i = 0; i < 220; ++i) {
    const int u = static_cast<int>(rng.below(static_cast<std::uint32_t>(size)));
    const int v = static_cast<int>(rng.below(static_cast<std::uint32_t>(size)));
    const int r = 1 + static_cast<int>(rng.below(3));
    fill_rect(image, u, v, u + r + 1, v + r + 1, base * static_cast<float>(rng.uniform(0.55, 1.5)));
  }
  return tiled(std::move(image), 2.2F, 2.2F);
}

PaintedMaterial floor_tiles(int variant, int size) {
  ColourImage image(size, size, to_rgb({176, 172, 164}));
  Rng rng(seed_of(variant, 8));
  const int n = 4;
  const int edge = size / n;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<float>(rng.uniform(0.88, 1.08));
      fill_rect(image, i * edge, j * edge, (i + 1) * edge, (j + 1) * edge,
                Paint{180, 175, 166} * k);
    }
  }
  add_grain(image, 16, 4, 0.25F, seed_of(variant, 9));
  for (int i = 0; i < n; ++i) {
    fill_rect(image, i * edge, 0, i * edge + 3, size, {120, 116, 110});
    fill_rect(image, 0, i * edge, size, i * edge + 3, {120, 116, 110});
  }
  return tiled(std::move(image), 2.0F, 2.0F);
}

PaintedMaterial wood(int variant, int size) {
  const Paint tones[] = {{186, 142, 92}, {150, 104, 64}, {206, 172, 124}, {112, 78, 52}};
  PaintedMaterial painted =
      tiled(wood_image(size / 2, size / 2, tones[variant % 4], seed_of(variant, 10)), 1.1F, 1.1F);
  painted.material.shine = 0.05F;
  return painted;
}

PaintedMaterial parquet(int variant, int size) {
  ColourImage image(size, size);
  Rng rng(seed_of(variant, 11));
  const ColourImage plank = wood_image(size, size, {172, 128, 84}, seed_of(variant, 12));
  const int rows = 10;
  const int row_height = size / rows;
  for (int row = 0; row < rows; ++row) {
    const int shift = static_cast<int>(rng.below(static_cast<std::uint32_t>(size)));
    auto tone = static_cast<float>(rng.uniform(0.8, 1.15));
    for (int u = 0; u < size; ++u) {
      const bool seam = (u + shift) % (size / 2) < 2;
      if (seam) tone = static_cast<float>(rng.uniform(0.8, 1.15));
      for (int v = row * row_height; v < (row + 1) * row_height; ++v) {
        const Rgb8& p = plank.at((u + shift) % size, v);
        const float k = seam || v == row * row_height ? 0.55F : tone;
        image.at(u, v) = to_rgb(
            Paint{static_cast<float>(p.r), static_cast<float>(p.g), static_cast<float>(p.b)} * k);
      }
    }
  }
  for (int v = rows * row_height; v < size; ++v) {
    for (int u = 0; u < size; ++u) image.at(u, v) = image.at(u, v - row_height);
  }
  return tiled(std::move(image), 1.8F, 1.4F);
}

PaintedMaterial brick(int variant, int size) {
  ColourImage image(size, size, to_rgb({178, 172, 164}));
  Rng rng(seed_of(variant, 13));
  const int rows = 16;
  const int columns = 6;
  for (int row = 0; row < rows; ++row) {
    for (int column = -1; column <= columns; ++column) {
      const int u = column * size / columns + (row % 2) * size / (2 * columns);
      const int v = row * size / rows;
      const auto k = static_cast<float>(rng.uniform(0.75, 1.1));
      fill_rect(image, u + 3, v + 3, u + size / columns, v + size / rows, Paint{158, 86, 66} * k);
    }
  }
  add_grain(image, 32, 3, 0.4F, seed_of(variant, 14));
  return tiled(std::move(image), 1.5F, 1.2F);
}

PaintedMaterial ceiling(int variant, int size) {
  ColourImage image(size / 2, size / 2, to_rgb({226, 226, 222}));
  add_grain(image, size / 8, 2, 0.10F, seed_of(variant, 15));
  draw_frame(image, 0, 0, size / 2, size / 2, 3, {186, 186, 184});
  return tiled(std::move(image), 0.62F, 0.62F);
}

PaintedMaterial concrete(int variant, int size) {
  ColourImage image(size, size, to_rgb({158, 156, 152}));
  add_grain(image, 4, 6, 0.55F, seed_of(variant, 16));
  fill_rect(image, 0, 0, size, 2, {110, 108, 104});
  fill_rect(image, 0, 0, 2, size, {110, 108, 104});
  return tiled(std::move(image), 2.4F, 2.4F);
}

PaintedMaterial board(int variant, int size) {
  const Paint tones[] = {{160, 126, 88}, {120, 134, 150}, {196, 192, 182}};
  ColourImage image(size, size, to_rgb(tones[variant % 3]));
  add_grain(image, size / 4, 2, 0.28F, seed_of(variant, 17));
  add_grain(image, 8, 3, 0.16F, seed_of(variant, 18));
  return tiled(std::move(image), 1.2F, 1.2F);
}

PaintedMaterial cabinet(int variant, int size) {
  const Paint tones[] = {{214, 214, 210}, {150, 152, 156}, {196, 164, 120}};
  ColourImage image(size / 2, size / 2, to_rgb(tones[variant % 3]));
  add_grain(image, 8, 3, 0.05F, seed_of(variant, 19));
  const int s = size / 2;
  for (int drawer = 0; drawer < 3; ++drawer) {
    const int top = drawer * s / 3;
    draw_frame(image, 2, top + 2, s - 2, top + s / 3 - 1, 2, tones[variant % 3] * 0.6F);
    fill_rect(image, s / 2 - s / 8, top + s / 14, s / 2 + s / 8, top + s / 14 + s / 40,
              {70, 70, 74});
  }
  return fitted(std::move(image));
}

PaintedMaterial door(int variant, int size) {
  ColourImage image =
      wood_image(size / 2, size, variant % 2 == 0 ? Paint{178, 134, 92} : Paint{206, 204, 198},
                 seed_of(variant, 20));
  const int w = size / 2;
  draw_frame(image, w / 8, size / 12, w * 7 / 8, size / 2 - size / 24, 4, {120, 92, 64});
  draw_frame(image, w / 8, size / 2 + size / 24, w * 7 / 8, size * 11 / 12, 4, {120, 92, 64});
  Rng rng(seed_of(variant, 21));
  fill_rect(image, w / 3, size / 6, w * 2 / 3, size / 6 + size / 12, {240, 240, 236});
  draw_text(image, w / 3 + 4, size / 6 + 4, w * 2 / 3 - 4, size / 6 + size / 12 - 2, size / 40,
            {40, 40, 60}, rng);
  return fitted(std::move(image));
}

PaintedMaterial window(int variant, int size) {
  Rng rng(seed_of(variant, 32));
  const int w = size / 2;
  const int h = size / 2;
  ColourImage image(w, h);
  for (int v = 0; v < h; ++v) {
    const float k = static_cast<float>(v) / static_cast<float>(h);
    fill_rect(image, 0, v, w, v + 1, Paint{196, 214, 238} * (1 - k) + Paint{236, 238, 238} * k);
  }
  for (int i = 0; i < 7; ++i) {  // houses across the street
    const int u = i * w / 7;
    const int top = h / 2 + static_cast<int>(rng.below(static_cast<std::uint32_t>(h / 5)));
    fill_rect(image, u, top, u + w / 7, h,
              Paint{176, 166, 158} * static_cast<float>(rng.uniform(0.8, 1.2)));
    for (int v = top + 8; v < h - 10; v += 16) {
      for (int x = u + 5; x < u + w / 7 - 7; x += 11)
        fill_rect(image, x, v, x + 6, v + 9, {92, 104, 120});
    }
  }
  draw_frame(image, 0, 0, w, h, 8, {226, 226, 224});
  fill_rect(image, w / 2 - 4, 0, w / 2 + 4, h, {226, 226, 224});
  PaintedMaterial painted = fitted(std::move(image));
  painted.material.glow = 0.8F;
  painted.material.ir_return = 0.0F;  // glass: the pattern does not come back
  return painted;
}

PaintedMaterial light_panel(int /*variant*/, int /*size*/) {
  ColourImage image(64, 64, to_rgb({250, 250, 244}));
  draw_frame(image, 0, 0, 64, 64, 3, {180, 180, 180});
  PaintedMaterial painted = fitted(std::move(image));
  painted.material.glow = 1.6F;
  painted.material.ir_return = 0.0F;
  return painted;
}

}  // namespace

const PainterTable& building_painters() {
  static const PainterTable table = {{"white", white},       {"plaster", plaster},
                                     {"carpet", carpet},     {"tiles", floor_tiles},
                                     {"wood", wood},         {"parquet", parquet},
                                     {"brick", brick},       {"ceiling", ceiling},
                                     {"concrete", concrete}, {"board", board},
                                     {"cabinet", cabinet},   {"door", door},
                                     {"window", window},     {"light_panel", light_panel}};
  return table;
}

}  // namespace ygslam::sim
