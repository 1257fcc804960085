// Which edges of a cube a surface crosses and how they join, for every pattern of corners inside
// (Lorensen and Cline 1987). Where two opposite corners of a face are inside, each is cut off by
// itself, from both sides of the face alike: the surface has no holes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace ygslam {

/// Corner c of a cube stands at (c & 1, c >> 1 & 1, c >> 2). An edge is its lower corner and the
/// axis along which it goes: 3 * corner + axis.
using CubeEdge = std::uint8_t;

/// @param inside bit c: corner c lies behind the surface. @return triangles whose corners turn
/// counter-clockwise as seen from outside.
[[nodiscard]] const std::vector<std::array<CubeEdge, 3>>& cube_triangles(std::uint8_t inside);

}  // namespace ygslam
