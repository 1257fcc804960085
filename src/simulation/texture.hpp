// Bitmaps with a mip chain. Textures are painted once, when a world is built, and then sampled.
#pragma once

#include <cstdint>
#include <vector>

#include "image/image.hpp"
#include "simulation/mesh.hpp"

namespace ygslam::sim {

/// Linear light from an 8-bit code value; the display curve is a plain square root, whose inverse
/// costs one multiplication per sample.
[[nodiscard]] constexpr float linear_from_code(float code) {
  const float v = code * (1.0F / 255.0F);
  return v * v;
}

/// Linear red, green, blue and a fourth lane that means nothing: computed with at once.
using Light = Eigen::Array4f;

class Texture {
 public:
  /// @param base any size > 0; repeated in both directions when sampled.
  explicit Texture(const ColourImage& base);

  /// Trilinear sample in linear light. @param uv 0..1 spans the bitmap, v downwards.
  /// @param footprint size of a pixel on the surface [texels of the finest level].
  [[nodiscard]] Light sample(const Vec2f& uv, float footprint) const;
  [[nodiscard]] Vec3f mean() const { return bilinear(levels_.back(), Vec2f(0.5F, 0.5F)).head<3>(); }

 private:
  /// Four bytes a texel, so that all channels are computed with at once.
  struct Level {
    int width = 0, height = 0;
    std::vector<std::uint32_t> texels;
  };
  static Level packed(const ColourImage& image);
  [[nodiscard]] static Light bilinear(const Level& level, const Vec2f& uv);
  std::vector<Level> levels_;  // finest first
};

}  // namespace ygslam::sim
