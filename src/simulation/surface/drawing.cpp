#include "simulation/surface/drawing.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam::sim {

namespace {

std::uint8_t byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
}

float lattice(int i, int j, std::uint64_t seed) {
  Rng rng(seed * 0x9e3779b97f4a7c15ULL + static_cast<std::uint64_t>(i) * 0x100000001b3ULL +
          static_cast<std::uint64_t>(j) * 0xc2b2ae3d27d4eb4fULL);
  return static_cast<float>(rng.next() >> 40) * 0x1.0p-24F;
}

int wrapped(int i, int cells) { return i >= 0 && i < cells ? i : (i % cells + cells) % cells; }

float smooth(float t) { return t * t * (3 - 2 * t); }

}  // namespace

Rgb8 to_rgb(const Paint& paint) { return {byte(paint.r), byte(paint.g), byte(paint.b)}; }

Paint random_paint(Rng& rng, float saturation, float value) {
  const auto hue = static_cast<float>(rng.uniform(0, 6));
  const auto channel = [&](float offset) {
    const float k = std::fmod(offset + hue, 6.0F);
    const float pure = std::clamp(std::min(k, 4 - k), 0.0F, 1.0F);
    return 255.0F * value * (1 - saturation * pure);
  };
  return {channel(5), channel(3), channel(1)};
}

ValueNoise::ValueNoise(int cells_u, int cells_v, std::uint64_t seed)
    : cells_u_(cells_u), cells_v_(cells_v) {
  lattice_.reserve(static_cast<std::size_t>(cells_u) * static_cast<std::size_t>(cells_v));
  for (int j = 0; j < cells_v; ++j) {
    for (int i = 0; i < cells_u; ++i) lattice_.push_back(lattice(i, j, seed));
  }
}

float ValueNoise::at(float u, float v) const {
  const float x = u * static_cast<float>(cells_u_);
  const float y = v * static_cast<float>(cells_v_);
  const int i = static_cast<int>(std::floor(x));
  const int j = static_cast<int>(std::floor(y));
  const float a = smooth(x - static_cast<float>(i));
  const float b = smooth(y - static_cast<float>(j));
  const int left = wrapped(i, cells_u_);
  const int right = wrapped(i + 1, cells_u_);
  const float* top = lattice_.data() + static_cast<std::ptrdiff_t>(wrapped(j, cells_v_)) * cells_u_;
  const float* low =
      lattice_.data() + static_cast<std::ptrdiff_t>(wrapped(j + 1, cells_v_)) * cells_u_;
  return (1 - b) * ((1 - a) * top[left] + a * top[right]) +
         b * ((1 - a) * low[left] + a * low[right]);
}

FractalNoise::FractalNoise(int cells, int octaves, std::uint64_t seed) {
  for (int o = 0; o < octaves; ++o)
    octaves_.emplace_back(cells << o, cells << o, seed + static_cast<std::uint64_t>(o));
}

float FractalNoise::at(float u, float v) const {
  float sum = 0;
  float weight = 0.5F;
  float total = 0;
  for (const ValueNoise& octave : octaves_) {
    sum += weight * octave.at(u, v);
    total += weight;
    weight *= 0.5F;
  }
  return sum / total;
}

void fill_rect(ColourImage& image, int u0, int v0, int u1, int v1, const Paint& paint) {
  const Rgb8 colour = to_rgb(paint);
  for (int v = std::max(0, v0); v < std::min(v1, image.height()); ++v) {
    for (int u = std::max(0, u0); u < std::min(u1, image.width()); ++u) image.at(u, v) = colour;
  }
}

void fill_disc(ColourImage& image, int cu, int cv, int radius, const Paint& paint) {
  const Rgb8 colour = to_rgb(paint);
  for (int v = std::max(0, cv - radius); v <= std::min(cv + radius, image.height() - 1); ++v) {
    for (int u = std::max(0, cu - radius); u <= std::min(cu + radius, image.width() - 1); ++u) {
      if ((u - cu) * (u - cu) + (v - cv) * (v - cv) <= radius * radius) image.at(u, v) = colour;
    }
  }
}

void draw_frame(ColourImage& image, int u0, int v0, int u1, int v1, int thickness,
                const Paint& paint) {
  fill_rect(image, u0, v0, u1, v0 + thickness, paint);
  fill_rect(image, u0, v1 - thickness, u1, v1, paint);
  fill_rect(image, u0, v0, u0 + thickness, v1, paint);
  fill_rect(image, u1 - thickness, v0, u1, v1, paint);
}

void draw_text(ColourImage& image, int u0, int v0, int u1, int v1, int line_height,
               const Paint& ink, Rng& rng) {
  const int glyph = std::max(2, line_height * 3 / 5);
  for (int v = v0; v + line_height <= v1; v += line_height) {
    const int end = u1 - static_cast<int>(rng.below(static_cast<std::uint32_t>((u1 - u0) / 3 + 1)));
    int u = u0;
    while (u + glyph < end) {
      const int letters = 2 + static_cast<int>(rng.below(7));
      for (int k = 0; k < letters && u + glyph < end; ++k, u += glyph) {
        const std::uint32_t shape = rng.below(16);
        const int stroke = std::max(1, glyph / 3);
        const int top = v + (shape & 8 ? 0 : line_height / 4);
        const int low = v + line_height * 3 / 4;
        if (shape & 1) fill_rect(image, u, top, u + stroke, low, ink);
        if (shape & 2) fill_rect(image, u + glyph - 1 - stroke, top, u + glyph - 1, low, ink);
        if (shape & 4) fill_rect(image, u, low - stroke, u + glyph - 1, low, ink);
        if (!(shape & 7)) fill_rect(image, u, top, u + glyph - 1, top + stroke, ink);
      }
      u += glyph;
    }
  }
}

void draw_photo(ColourImage& image, int u0, int v0, int u1, int v1, Rng& rng) {
  const Paint sky = random_paint(rng, 0.4F, 0.9F);
  const Paint ground = random_paint(rng, 0.5F, 0.5F);
  const int height = std::max(1, v1 - v0);
  for (int v = v0; v < v1; ++v) {
    const float k = static_cast<float>(v - v0) / static_cast<float>(height);
    fill_rect(image, u0, v, u1, v + 1, sky * (1 - k) + ground * k);
  }
  const int shapes = 8 + static_cast<int>(rng.below(14));
  const auto width = static_cast<std::uint32_t>(std::max(4, u1 - u0));
  for (int i = 0; i < shapes; ++i) {
    const Paint paint = random_paint(rng, 0.6F, static_cast<float>(rng.uniform(0.1, 0.95)));
    const int w = 2 + static_cast<int>(rng.below(width / 3));
    const int h = 2 + static_cast<int>(rng.below(static_cast<std::uint32_t>(height) / 3 + 1));
    const int u = u0 + static_cast<int>(rng.below(width));
    const int v = v0 + static_cast<int>(rng.below(static_cast<std::uint32_t>(height)));
    const int r = std::min(w, h) / 2;
    if (rng.below(3) == 0 && u - r >= u0 && u + r < u1 && v - r >= v0 && v + r < v1) {
      fill_disc(image, u, v, r, paint);
    } else {
      fill_rect(image, u, v, std::min(u + w, u1), std::min(v + h, v1), paint);
    }
  }
}

void add_grain(ColourImage& image, int cells, int octaves, float strength, std::uint64_t seed) {
  const FractalNoise grain(cells, octaves, seed);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      const float noise = grain.at(static_cast<float>(u) / static_cast<float>(image.width()),
                                   static_cast<float>(v) / static_cast<float>(image.height()));
      const float k = 1 + strength * (noise - 0.5F);
      Rgb8& p = image.at(u, v);
      p = to_rgb(Paint{static_cast<float>(p.r), static_cast<float>(p.g), static_cast<float>(p.b)} *
                 k);
    }
  }
}

}  // namespace ygslam::sim
