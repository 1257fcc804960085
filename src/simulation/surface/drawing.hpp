// Drawing on colour images: the vocabulary of the procedural textures.
#pragma once

#include <vector>

#include "core/rng.hpp"
#include "image/image.hpp"

namespace ygslam::sim {

/// A colour with components 0..255 that may be computed with.
struct Paint {
  float r = 0, g = 0, b = 0;
  [[nodiscard]] Paint operator*(float k) const { return {r * k, g * k, b * k}; }
  [[nodiscard]] Paint operator+(const Paint& o) const { return {r + o.r, g + o.g, b + o.b}; }
};
[[nodiscard]] Rgb8 to_rgb(const Paint& paint);
/// Saturated random colour. @param value brightness 0..1.
[[nodiscard]] Paint random_paint(Rng& rng, float saturation, float value);

/// Periodic smooth noise in [0, 1]: `cells` lattice cells span 0..1 in each direction. The lattice
/// is drawn once, for painting asks for every pixel.
class ValueNoise {
 public:
  ValueNoise(int cells_u, int cells_v, std::uint64_t seed);
  [[nodiscard]] float at(float u, float v) const;

 private:
  int cells_u_, cells_v_;
  std::vector<float> lattice_;
};

/// Sum of `octaves` value noises, each twice as fine and half as strong, in [0, 1].
class FractalNoise {
 public:
  FractalNoise(int cells, int octaves, std::uint64_t seed);
  [[nodiscard]] float at(float u, float v) const;

 private:
  std::vector<ValueNoise> octaves_;
};

void fill_rect(ColourImage& image, int u0, int v0, int u1, int v1, const Paint& paint);
void fill_disc(ColourImage& image, int cu, int cv, int radius, const Paint& paint);
void draw_frame(ColourImage& image, int u0, int v0, int u1, int v1, int thickness,
                const Paint& paint);
/// Lines of words made of small strokes, as print looks from afar.
void draw_text(ColourImage& image, int u0, int v0, int u1, int v1, int line_height,
               const Paint& ink, Rng& rng);
/// Something like a photograph: patches of colour over a gradient.
void draw_photo(ColourImage& image, int u0, int v0, int u1, int v1, Rng& rng);
/// Multiplies every pixel by 1 + strength * (fractal noise - 0.5).
void add_grain(ColourImage& image, int cells, int octaves, float strength, std::uint64_t seed);

}  // namespace ygslam::sim
