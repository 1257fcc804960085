#include "simulation/surface/materials.hpp"

#include <cmath>

#include "core/parallel.hpp"
#include "simulation/surface/paint_material.hpp"

namespace ygslam::sim {

namespace {

float texel_size_m(const Material& material, const ColourImage& frame) {
  const auto width = static_cast<float>(frame.width());
  const auto height = static_cast<float>(frame.height());
  constexpr float kFittedWidth_m = 0.5F;
  if (material.tile_u_m == 0) return kFittedWidth_m / width;
  return std::sqrt(material.tile_u_m / width * material.tile_v_m / height);
}

}  // namespace

MaterialId MaterialLibrary::reserve() {
  materials_.emplace_back();
  return static_cast<MaterialId>(materials_.size() - 1);
}

MaterialId MaterialLibrary::get(const std::string& kind, int variant) {
  const auto [entry, is_new] = known_.try_emplace({kind, variant}, MaterialId{0});
  if (is_new) {
    entry->second = reserve();
    to_paint_.push_back({kind, variant, entry->second});
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
    entry->second = reserve();
    Material& material = materials_.back();
    material.tint = {linear_from_code(rgb.x()), linear_from_code(rgb.y()),
                     linear_from_code(rgb.z())};
    material.ir_return = ir_return;
    material.shine = shine;
    to_colour_.push_back(entry->second);
  }
  return entry->second;
}

MaterialId MaterialLibrary::picture(const ColourImage& image, float glow) {
  const MaterialId id = reserve();
  Material& material = materials_.back();
  material.glow = glow;
  material.texel_m = texel_size_m(material, image);
  material.frames.push_back(static_cast<std::uint16_t>(textures_.size()));
  textures_.emplace_back(image);
  return id;
}

void MaterialLibrary::paint(int threads) {
  const MaterialId white = to_colour_.empty() ? MaterialId{0} : get("white");
  struct Painted {
    Material material;
    std::vector<Texture> frames;
  };
  std::vector<Painted> painted(to_paint_.size());
  parallel_for(static_cast<int>(painted.size()), threads, [&](int i) {
    const Order& order = to_paint_[static_cast<std::size_t>(i)];
    Painted& out = painted[static_cast<std::size_t>(i)];
    PaintedMaterial bitmaps = paint_material(order.kind, order.variant, texture_size_);
    out.material = std::move(bitmaps.material);
    out.material.texel_m = texel_size_m(out.material, bitmaps.frames.at(0));
    for (const ColourImage& frame : bitmaps.frames) out.frames.emplace_back(frame);
  });
  for (std::size_t i = 0; i < painted.size(); ++i) {
    for (Texture& frame : painted[i].frames) {
      painted[i].material.frames.push_back(static_cast<std::uint16_t>(textures_.size()));
      textures_.push_back(std::move(frame));
    }
    materials_[to_paint_[i].id] = std::move(painted[i].material);
  }
  for (const MaterialId id : to_colour_) {
    Material material = materials_[white];
    material.tint = materials_[id].tint;
    material.ir_return = materials_[id].ir_return;
    material.shine = materials_[id].shine;
    materials_[id] = std::move(material);
  }
  to_paint_.clear();
  to_colour_.clear();
}

}  // namespace ygslam::sim
