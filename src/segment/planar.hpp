// Interleaved bytes to the planar floats a network takes.
#pragma once

#include "image/image.hpp"

namespace ygslam {

/// @param planes 3 x height x width floats to fill: red, green, blue, each 0..1.
void to_planar(const ColourImage& image, float* planes);

}  // namespace ygslam
