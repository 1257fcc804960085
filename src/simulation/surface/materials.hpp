// Materials by name: a procedural texture with the way light and the depth sensor see it.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "simulation/surface/texture.hpp"

namespace ygslam::sim {

struct Material {
  std::vector<std::uint16_t> frames;  ///< textures; more than one = a video, shown at 10 Hz
  float tile_u_m = 0;                 ///< size of one tile [m]; 0 = fitted, uv 0..1
  float tile_v_m = 0;
  float texel_m = 0.001F;      ///< size of a texel on the surface (of fitted ones a guess)
  Vec3f tint = Vec3f::Ones();  ///< multiplies the texture (linear light)
  float glow = 0;              ///< emitted light as a share of the texture's colour
  float shine = 0;             ///< specular share 0..1
  float ir_return = 1;         ///< what a structured-light depth sensor gets back, 0..1
};

/// Each material is painted once: get() and plain() hand out ids, and paint() does the work when
/// all that a world needs is known, on several threads.
class MaterialLibrary {
 public:
  /// @param texture_size edge of the tiled bitmaps [texels], a power of two
  explicit MaterialLibrary(int texture_size = 512) : texture_size_(texture_size) {}

  /// @param kind one of material_kinds(). @param variant picks colours and content.
  [[nodiscard]] MaterialId get(const std::string& kind, int variant = 0);
  /// A plain colour with faint grain. @param rgb code values 0..255.
  [[nodiscard]] MaterialId plain(const Vec3f& rgb, float ir_return = 1, float shine = 0);

  /// A picture of one's own, shown once. @param glow emitted light as a share of its colour.
  [[nodiscard]] MaterialId picture(const ColourImage& image, float glow = 0);

  /// Paints what has been asked for since the last call; only then material() and texture() tell of
  /// it. The result does not depend on `threads`.
  void paint(int threads);

  [[nodiscard]] const Material& material(MaterialId id) const { return materials_[id]; }
  [[nodiscard]] std::size_t size() const { return materials_.size(); }
  [[nodiscard]] const Texture& texture(std::uint16_t index) const { return textures_[index]; }

 private:
  struct Order {
    std::string kind;
    int variant;
    MaterialId id;
  };
  MaterialId reserve();

  int texture_size_;
  std::vector<Texture> textures_;
  std::vector<Material> materials_;
  std::vector<Order> to_paint_;
  std::vector<MaterialId> to_colour_;  // of the plain ones
  std::map<std::pair<std::string, int>, MaterialId> known_;
  std::map<std::uint32_t, MaterialId> plain_;
};

/// The names MaterialLibrary::get accepts.
[[nodiscard]] const std::vector<std::string>& material_kinds();

}  // namespace ygslam::sim
