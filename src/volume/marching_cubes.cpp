#include "volume/marching_cubes.hpp"

#include <algorithm>
#include <utility>

namespace ygslam {
namespace {

constexpr int kEdgeCodes = 24;

CubeEdge edge_between(int a, int b) {
  const int axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  return static_cast<CubeEdge>(3 * std::min(a, b) + axis);
}

/// For each edge the surface crosses, the edge that follows on the face on which the corners,
/// counter-clockwise as seen from outside the cube, go in at the first and out at the second.
std::array<int, kEdgeCodes> successors(std::uint8_t inside) {
  std::array<int, kEdgeCodes> next{};
  next.fill(-1);
  const auto is_inside = [&](int corner) { return (inside >> corner & 1) != 0; };
  for (int axis = 0; axis < 3; ++axis) {
    const int b = 1 << (axis + 1) % 3;
    const int c = 1 << (axis + 2) % 3;
    for (const int side : {0, 1 << axis}) {
      std::array<int, 4> ring{side, side + b, side + b + c, side + c};
      if (side == 0) std::reverse(ring.begin(), ring.end());
      const auto corner = [&](int i) { return ring[static_cast<std::size_t>(i % 4)]; };
      for (int i = 0; i < 4; ++i) {
        if (is_inside(corner(i)) || !is_inside(corner(i + 1))) continue;
        int last = i + 1;
        while (is_inside(corner(last + 1))) ++last;
        next[edge_between(corner(i), corner(i + 1))] = edge_between(corner(last), corner(last + 1));
      }
    }
  }
  return next;
}

std::vector<std::array<CubeEdge, 3>> triangulate(std::uint8_t inside) {
  std::array<int, kEdgeCodes> next = successors(inside);
  std::vector<std::array<CubeEdge, 3>> triangles;
  for (int first = 0; first < kEdgeCodes; ++first) {
    std::vector<CubeEdge> loop;
    for (int edge = first; next[static_cast<std::size_t>(edge)] >= 0;) {
      loop.push_back(static_cast<CubeEdge>(edge));
      edge = std::exchange(next[static_cast<std::size_t>(edge)], -1);
    }
    for (std::size_t i = 2; i < loop.size(); ++i)
      triangles.push_back({loop[0], loop[i - 1], loop[i]});
  }
  return triangles;
}

}  // namespace

const std::vector<std::array<CubeEdge, 3>>& cube_triangles(std::uint8_t inside) {
  static const auto table = [] {
    std::array<std::vector<std::array<CubeEdge, 3>>, 256> all;
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = triangulate(static_cast<std::uint8_t>(i));
    return all;
  }();
  return table[inside];
}

}  // namespace ygslam
