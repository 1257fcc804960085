// How each kind of material is painted.
#pragma once

#include <string>
#include <vector>

#include "simulation/surface/materials.hpp"

namespace ygslam::sim {

struct PaintedMaterial {
  Material material;
  std::vector<ColourImage> frames;
};

/// @param size edge of tiled bitmaps [texels]. A bug if the kind is unknown.
[[nodiscard]] PaintedMaterial paint_material(const std::string& kind, int variant, int size);

}  // namespace ygslam::sim
