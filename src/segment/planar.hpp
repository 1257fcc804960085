// Interleaved bytes to the planar floats a network takes.
#pragma once

#include <array>

#include "image/image.hpp"

namespace ygslam {

enum class ChannelOrder { kRgb, kBgr };

/// A byte b becomes (b - mean) / std.
struct Normalisation {
  std::array<float, 3> mean{0, 0, 0};       ///< of red, green, blue
  std::array<float, 3> std{255, 255, 255};  ///< of red, green, blue
  ChannelOrder order = ChannelOrder::kRgb;  ///< of the planes
};

/// @param planes 3 x height x width floats to fill.
void to_planar(const ColourImage& image, const Normalisation& form, float* planes);

}  // namespace ygslam
