// The triangles of one block's cubes, small enough to keep one for every block.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/scene.hpp"
#include "volume/surface_layer.hpp"

namespace ygslam {

/// Where the surface crosses an edge between two neighbouring voxels.
struct BlockVertex {
  std::uint16_t edge = 0;      ///< 3 * cell_offset(lower voxel) + axis
  std::uint16_t fraction = 0;  ///< of the way from the lower voxel to the upper [1/65535]
  std::array<std::int16_t, 3> normal_world{};  ///< [1/32767]
  Rgb8 colour;
  std::uint8_t probability = 0;  ///< share of votes for the object [1/255]
  SceneObjectId object = kNoSceneObject;
  std::uint16_t views = 0;  ///< of the voxel that fewer views saw

  [[nodiscard]] SurfacePoint point(const Eigen::Vector3i& block, double voxel_m) const;
};

struct BlockMesh {
  std::vector<BlockVertex> vertices;  ///< in ascending order of edges
  /// Corners: edge | offset << 11. The edge belongs to the block at that offset: bits 0, 1, 2 are
  /// one step along x, y, z.
  std::vector<std::array<std::uint16_t, 3>> triangles;

  [[nodiscard]] bool empty() const { return vertices.empty() && triangles.empty(); }
};

/// @param min_views that a voxel needs to be believed.
[[nodiscard]] BlockMesh mesh_block(const SurfaceLayer& layer, BlockKey key, int min_views);

}  // namespace ygslam
