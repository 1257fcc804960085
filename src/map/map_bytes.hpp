// The map as bytes: two maps are the same if these are.
#pragma once

#include <string>

#include "map/map.hpp"

namespace ygslam {

/// What belongs to the run alone is left out: which frame a keyframe was made of, where fused
/// landmarks went.
[[nodiscard]] std::string to_bytes(const Map& map);

}  // namespace ygslam
