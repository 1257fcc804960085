#include "volume/mesh_assembly.hpp"

#include <algorithm>

#include "core/check.hpp"
#include "volume/mesh_pieces.hpp"

namespace ygslam {
namespace {

constexpr std::uint32_t kUnused = 0xffffffffU;
constexpr int kEdgeBits = 11;
constexpr std::uint16_t kEdgeMask = (1 << kEdgeBits) - 1;

class Assembly {
 public:
  Assembly(const Volume& volume, const std::vector<PlacedMesh>& blocks, const ReadingConfig& config)
      : volume_(volume), blocks_(blocks), config_(config), first_vertex_(blocks.size() + 1) {
    for (std::size_t i = 0; i < blocks.size(); ++i)
      first_vertex_[i + 1] =
          first_vertex_[i] + static_cast<std::uint32_t>(blocks[i].mesh->vertices.size());
  }

  TriangleMesh mesh() {
    place_vertices();
    join_triangles();
    drop_small_pieces();
    return compacted();
  }

 private:
  void place_vertices() {
    const double voxel_m = volume_.config().surface.voxel_m;
    points_.reserve(first_vertex_.back());
    seen_through_.reserve(first_vertex_.back());
    for (const PlacedMesh& placed : blocks_) {
      const Eigen::Vector3i block = block_of(placed.key);
      for (const BlockVertex& vertex : placed.mesh->vertices) {
        points_.push_back(vertex.point(block, voxel_m));
        const int through =
            volume_.space().counts_at(points_.back().p_world.cast<double>()).through;
        seen_through_.push_back(through > config_.max_through_ratio * vertex.views);
      }
    }
  }

  /// @return the block's place in the list; its size where there is none.
  [[nodiscard]] std::size_t find_block(BlockKey key) const {
    const auto found =
        std::lower_bound(blocks_.begin(), blocks_.end(), key,
                         [](const PlacedMesh& b, BlockKey wanted) { return b.key < wanted; });
    return found != blocks_.end() && found->key == key
               ? static_cast<std::size_t>(found - blocks_.begin())
               : blocks_.size();
  }

  /// Numbers of a block's vertices by their edge.
  [[nodiscard]] std::uint32_t vertex_of(std::size_t block, std::uint16_t edge) const {
    const std::vector<BlockVertex>& vertices = blocks_[block].mesh->vertices;
    const auto found = std::lower_bound(
        vertices.begin(), vertices.end(), edge,
        [](const BlockVertex& v, std::uint16_t wanted) { return v.edge < wanted; });
    CHECK(found != vertices.end() && found->edge == edge);
    return first_vertex_[block] + static_cast<std::uint32_t>(found - vertices.begin());
  }

  void join_triangles() {
    std::size_t most = 0;
    for (const PlacedMesh& placed : blocks_) most += placed.mesh->triangles.size();
    triangles_.reserve(most);
    std::array<std::uint32_t, 3 * kBlockCells> own{};
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      const BlockMesh& mesh = *blocks_[i].mesh;
      for (std::size_t k = 0; k < mesh.vertices.size(); ++k)
        own[mesh.vertices[k].edge] = first_vertex_[i] + static_cast<std::uint32_t>(k);
      std::array<std::size_t, 8> neighbour{};
      neighbour.fill(kUnknown);
      const Eigen::Vector3i block = block_of(blocks_[i].key);
      for (const auto& codes : mesh.triangles) {
        std::array<std::uint32_t, 3> triangle{};
        for (std::size_t k = 0; k < 3; ++k) {
          const auto edge = static_cast<std::uint16_t>(codes[k] & kEdgeMask);
          const int offset = codes[k] >> kEdgeBits;
          if (offset == 0) {
            triangle[k] = own[edge];
            continue;
          }
          std::size_t& other = neighbour[static_cast<std::size_t>(offset)];
          if (other == kUnknown)
            other = find_block(
                block_key(block + Eigen::Vector3i(offset & 1, offset >> 1 & 1, offset >> 2)));
          CHECK(other < blocks_.size());
          triangle[k] = vertex_of(other, edge);
        }
        if (!seen_through_[triangle[0]] && !seen_through_[triangle[1]] &&
            !seen_through_[triangle[2]])
          triangles_.push_back(triangle);
      }
    }
  }

  void drop_small_pieces() {
    if (std::max(config_.min_triangles, config_.min_thing_triangles) <= 1) return;
    Pieces pieces(points_.size());
    for (const auto& t : triangles_) {
      pieces.join(t[0], t[1]);
      pieces.join(t[0], t[2]);
    }
    std::vector<int> size(points_.size(), 0), of_things(points_.size(), 0);
    for (const auto& t : triangles_) {
      const std::uint32_t root = pieces.root(t[0]);
      ++size[root];
      if (points_[t[0]].label.object != kNoSceneObject) ++of_things[root];  // a corner tells enough
    }
    std::erase_if(triangles_, [&](const auto& t) {
      const std::uint32_t root = pieces.root(t[0]);
      const bool shows_thing = 2 * of_things[root] > size[root];
      return size[root] < (shows_thing ? config_.min_thing_triangles : config_.min_triangles);
    });
  }

  TriangleMesh compacted() {
    std::vector<std::uint32_t> number(points_.size(), kUnused);
    for (const auto& t : triangles_)
      for (const std::uint32_t vertex : t) number[vertex] = 0;
    std::uint32_t kept = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (number[i] == kUnused) continue;
      points_[kept] = points_[i];  // in place: a mesh may be large
      number[i] = kept++;
    }
    points_.resize(kept);
    for (auto& t : triangles_)
      for (std::uint32_t& vertex : t) vertex = number[vertex];
    return {std::move(points_), std::move(triangles_)};
  }

  static constexpr std::size_t kUnknown = ~std::size_t{0};
  const Volume& volume_;
  const std::vector<PlacedMesh>& blocks_;
  const ReadingConfig& config_;
  std::vector<std::uint32_t> first_vertex_;
  std::vector<SurfacePoint> points_;
  std::vector<bool> seen_through_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
};

}  // namespace

TriangleMesh assemble_mesh(const Volume& volume, const std::vector<PlacedMesh>& blocks,
                           const ReadingConfig& config) {
  return Assembly(volume, blocks, config).mesh();
}

}  // namespace ygslam
