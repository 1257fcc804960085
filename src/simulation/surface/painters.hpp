// What the painters of materials share. For the painters_*.cpp files.
#pragma once

#include <map>
#include <string>

#include "simulation/surface/drawing.hpp"
#include "simulation/surface/paint_material.hpp"

namespace ygslam::sim {

/// @param size edge of tiled bitmaps [texels]
using Painter = PaintedMaterial (*)(int variant, int size);
using PainterTable = std::map<std::string, Painter>;

[[nodiscard]] const PainterTable& building_painters();  ///< walls, floors, wood, windows
[[nodiscard]] const PainterTable& office_painters();    ///< books, paper, screens, boxes
[[nodiscard]] const PainterTable& people_painters();    ///< cloth, skin, hair

[[nodiscard]] inline std::uint64_t seed_of(int variant, std::uint64_t salt) {
  return static_cast<std::uint64_t>(variant) * 7919U + salt * 104729U + 1U;
}
[[nodiscard]] inline PaintedMaterial tiled(ColourImage image, float tile_u_m, float tile_v_m) {
  PaintedMaterial painted;
  painted.material.tile_u_m = tile_u_m;
  painted.material.tile_v_m = tile_v_m;
  painted.frames.push_back(std::move(image));
  return painted;
}
[[nodiscard]] inline PaintedMaterial fitted(ColourImage image) {
  return tiled(std::move(image), 0, 0);
}

}  // namespace ygslam::sim
