// Two maps of one place become one.
#pragma once

#include "loop/map_alignment.hpp"
#include "mapping/mapper.hpp"

namespace ygslam {

/// What of b lies where in a is known (align_maps); b's keyframes and landmarks are added to a with
/// new numbers, what both show is fused, and all is adjusted. The frame of a stays.
/// @param alignment with at least one pair.
[[nodiscard]] Map merge_maps(const Map& a, const Map& b, const MapAlignment& alignment,
                             const Camera& camera, const MapperConfig& config);

}  // namespace ygslam
