// The map as bytes and back: what a file or another process needs to go on with it.
#pragma once

#include <span>
#include <string>

#include "core/result.hpp"
#include "map/map.hpp"

namespace ygslam {

/// Little endian, with a schema version and a checksum; the same map gives the same bytes. What
/// belongs to the run alone is left out: which frame a keyframe was made of, where fused landmarks
/// went.
[[nodiscard]] std::string to_bytes(const Map& map);

/// Everything is checked: counts against the bytes there are, numbers for being finite, references
/// for what they refer to. The ids of the map go on after those it had.
/// @param bounds of the camera's undistorted image (Camera::ideal_bounds).
/// @return kSavedMap: bytes that are damaged, cut short or of another schema.
[[nodiscard]] Result<Map> map_from_bytes(std::span<const char> bytes,
                                         const std::array<double, 4>& bounds);

}  // namespace ygslam
