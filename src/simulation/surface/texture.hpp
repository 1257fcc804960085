// Bitmaps with a mip chain. Textures are painted once, when a world is built, and then sampled.
#pragma once

#include <cstdint>
#include <vector>

#include "image/image.hpp"
#include "simulation/surface/mesh.hpp"

namespace ygslam::sim {

/// Linear light from an 8-bit code value; the display curve is a plain square root, whose inverse
/// costs one multiplication per sample.
[[nodiscard]] constexpr float linear_from_code(float code) {
  const float v = code * (1.0F / 255.0F);
  return v * v;
}

/// Linear red, green, blue and a fourth lane that means nothing: computed with at once.
using Light = float __attribute__((vector_size(16)));

class Texture {
 public:
  /// @param base any size > 0; repeated in both directions when sampled.
  explicit Texture(const ColourImage& base);

  /// Trilinear sample in linear light: red, green, blue and a number that means nothing.
  /// @param u, v from 0 to 1 across the bitmap, v downwards: anything, it repeats.
  /// @param footprint size of a pixel on the surface [texels of the finest level].
  [[nodiscard]] Light sample(float u, float v, float footprint) const;
  [[nodiscard]] Vec3f mean() const;

 private:
  /// Four bytes a texel, so that all channels are computed with at once. The first column and the
  /// first row come once more at the end: the right and the lower neighbour are always there.
  struct Level {
    int width = 0, height = 0;  ///< without the repeated ones
    std::vector<std::uint32_t> texels;
  };
  static Level packed(const ColourImage& image);
  /// @param u, v from 0 to 1
  [[nodiscard]] static Light bilinear(const Level& level, float u, float v);
  std::vector<Level> levels_;  // finest first
};

}  // namespace ygslam::sim
