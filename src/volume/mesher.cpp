#include "volume/mesher.hpp"

#include <algorithm>
#include <iterator>

#include "core/parallel.hpp"
#include "volume/mesh_assembly.hpp"

namespace ygslam {
namespace {

constexpr int kMeshedAtOnce = 32;

/// Meshes of blocks, in the order of the keys.
std::vector<BlockMesh> mesh_blocks(const Volume& volume, const std::vector<BlockKey>& keys,
                                   int min_views) {
  std::vector<BlockMesh> meshes(keys.size());
  const int count = static_cast<int>(keys.size());
  parallel_for((count + kMeshedAtOnce - 1) / kMeshedAtOnce, volume.config().threads,
               [&](int chunk) {
                 const int end = std::min((chunk + 1) * kMeshedAtOnce, count);
                 for (int i = chunk * kMeshedAtOnce; i < end; ++i) {
                   const auto k = static_cast<std::size_t>(i);
                   meshes[k] = mesh_block(volume.surface(), keys[k], min_views);
                 }
               });
  return meshes;
}

}  // namespace

int Mesher::update(const Volume& volume) {
  const SurfaceLayer& layer = volume.surface();
  std::vector<BlockKey> keys = layer.blocks().keys();
  std::vector<BlockKey> changed;
  std::set_difference(seen_keys_.begin(), seen_keys_.end(), keys.begin(), keys.end(),
                      std::back_inserter(changed));
  for (const BlockKey key : changed) meshes_.erase(key);
  for (const BlockKey key : keys)
    if (layer.blocks().find(key)->revision > seen_revision_) changed.push_back(key);

  // A block's triangles and normals depend on its neighbours.
  BlockSet stale;
  for (const BlockKey key : changed) {
    const Eigen::Vector3i block = block_of(key);
    for (int i = 0; i < 27; ++i) {
      const BlockKey near = block_key(block + Eigen::Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
      if (layer.blocks().find(near) != nullptr) stale.insert(near);
    }
  }
  std::vector<BlockMesh> renewed = mesh_blocks(volume, stale.keys(), config_.min_views);
  for (std::size_t i = 0; i < renewed.size(); ++i) {
    if (renewed[i].empty())
      meshes_.erase(stale.keys()[i]);
    else
      meshes_[stale.keys()[i]] = std::move(renewed[i]);
  }
  seen_keys_ = std::move(keys);
  seen_revision_ = layer.revision();
  return static_cast<int>(renewed.size());
}

TriangleMesh Mesher::mesh(const Volume& volume) const {
  std::vector<PlacedMesh> placed;
  placed.reserve(meshes_.size());
  for (const auto& [key, mesh] : meshes_) placed.push_back({key, &mesh});
  return assemble_mesh(volume, placed, config_);
}

std::size_t Mesher::memory_bytes() const {
  std::size_t bytes = seen_keys_.capacity() * sizeof(BlockKey);
  for (const auto& [key, mesh] : meshes_)
    bytes += sizeof(key) + sizeof(mesh) + 4 * sizeof(void*) +
             mesh.vertices.capacity() * sizeof(BlockVertex) +
             mesh.triangles.capacity() * sizeof(mesh.triangles[0]);
  return bytes;
}

TriangleMesh volume_mesh(const Volume& volume, const ReadingConfig& config) {
  const std::vector<BlockKey> keys = volume.surface().blocks().keys();
  const std::vector<BlockMesh> meshes = mesh_blocks(volume, keys, config.min_views);
  std::vector<PlacedMesh> placed;
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (!meshes[i].empty()) placed.push_back({keys[i], &meshes[i]});
  return assemble_mesh(volume, placed, config);
}

}  // namespace ygslam
