#include "simulation/materials.hpp"

#include <cmath>

#include "simulation/texture_recipes.hpp"

namespace ygslam::sim {

MaterialId MaterialLibrary::add(Material material, std::vector<ColourImage> frames) {
  const auto width = static_cast<float>(frames.at(0).width());
  const auto height = static_cast<float>(frames.at(0).height());
  constexpr float kFittedWidth_m = 0.5F;
  material.texel_m = material.tile_u_m == 0
                         ? kFittedWidth_m / width
                         : std::sqrt(material.tile_u_m / width * material.tile_v_m / height);
  for (const ColourImage& frame : frames) {
    material.frames.push_back(static_cast<std::uint16_t>(textures_.size()));
    textures_.emplace_back(frame);
  }
  materials_.push_back(std::move(material));
  return static_cast<MaterialId>(materials_.size() - 1);
}

MaterialId MaterialLibrary::get(const std::string& kind, int variant) {
  const auto [entry, is_new] = known_.try_emplace({kind, variant}, MaterialId{0});
  if (is_new) {
    PaintedMaterial painted = paint_material(kind, variant, texture_size_);
    entry->second = add(std::move(painted.material), std::move(painted.frames));
  }
  return entry->second;
}

MaterialId MaterialLibrary::plain(const Vec3f& rgb, float ir_return, float shine) {
  const auto code = [](float v) { return static_cast<std::uint32_t>(v) & 0xffU; };
  const auto share = [](float v) { return static_cast<std::uint32_t>(v * 15.0F + 0.5F) & 0xfU; };
  const std::uint32_t key = code(rgb.x()) | code(rgb.y()) << 8U | code(rgb.z()) << 16U |
                            share(ir_return) << 24U | share(shine) << 28U;
  const auto [entry, is_new] = plain_.try_emplace(key, MaterialId{0});
  if (is_new) {
    Material material = material_of_white();
    material.tint = {linear_from_code(rgb.x()), linear_from_code(rgb.y()),
                     linear_from_code(rgb.z())};
    material.ir_return = ir_return;
    material.shine = shine;
    materials_.push_back(material);
    entry->second = static_cast<MaterialId>(materials_.size() - 1);
  }
  return entry->second;
}

Material MaterialLibrary::material_of_white() { return materials_[get("white")]; }

}  // namespace ygslam::sim
