// The volume's surface as a triangle mesh: all of it, or kept up to date block by block.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "scene/scene.hpp"
#include "volume/block_mesh.hpp"
#include "volume/reading.hpp"
#include "volume/volume.hpp"

namespace ygslam {

/// Keeps the triangles of every block and renews those that changed.
class Mesher {
 public:
  explicit Mesher(const ReadingConfig& config = {}) : config_(config) {}

  /// Renews the blocks that changed since the last call; always of the same volume.
  /// @return how many were renewed.
  int update(const Volume& volume);
  /// The mesh as of the last update(). Blocks stand in ascending order of their keys: equal
  /// contents give equal bytes. Labels name the object and its share of the votes; classes are
  /// not known here.
  [[nodiscard]] TriangleMesh mesh(const Volume& volume) const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  ReadingConfig config_;
  std::uint64_t seen_revision_ = 0;
  std::vector<BlockKey> seen_keys_;       // ascending
  std::map<BlockKey, BlockMesh> meshes_;  // without empty ones
};

/// The mesh from nothing; the same bytes as an updated Mesher's.
[[nodiscard]] TriangleMesh volume_mesh(const Volume& volume, const ReadingConfig& config = {});

}  // namespace ygslam
