// One mesh from the meshes of blocks.
#pragma once

#include <vector>

#include "volume/mesher.hpp"

namespace ygslam {

struct PlacedMesh {
  BlockKey key = 0;
  const BlockMesh* mesh = nullptr;
};

/// Joins the blocks' vertices and leaves out what later views saw through, pieces that are too
/// small, and vertices without a triangle.
/// @param blocks in ascending order of keys.
[[nodiscard]] TriangleMesh assemble_mesh(const Volume& volume,
                                         const std::vector<PlacedMesh>& blocks,
                                         const ReadingConfig& config);

}  // namespace ygslam
