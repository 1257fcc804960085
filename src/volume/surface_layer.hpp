// The surface: signed distance, colour, views and votes for objects in blocks of 8^3 voxels,
// of which only the eighths near a surface take memory.
//
// All sums are whole numbers. A view at a pose adds the same numbers whenever and beside whatever
// it is added, so that contributions may come in any order and are taken back exactly; a block
// exists if and only if some view contributes to it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "geometry/se3.hpp"
#include "scene/scene.hpp"
#include "volume/block_store.hpp"
#include "volume/prepared_view.hpp"

namespace ygslam {

struct SurfaceConfig {
  double voxel_m = 0.02;
  double truncation_voxels = 3;  ///< the signed distance is kept up to this from the surface,
  double truncation_sigmas = 3;  ///< or up to this, if more
};

/// Votes of views for one object, by voxel of a block (cell_offset(x, y, z)).
struct ObjectVotes {
  SceneObjectId object = kNoSceneObject;
  std::uint32_t total = 0;
  std::array<std::uint16_t, kBlockCells> votes{};
};

inline constexpr int kBrickSide = 4;
inline constexpr int kBrickVoxels = kBrickSide * kBrickSide * kBrickSide;

/// An eighth of a block: sums over the views that saw a voxel close to a surface. Voxel (x, y, z)
/// of the brick stands at (z * 4 + y) * 4 + x.
struct alignas(64) SurfaceBrick {
  /// Distances [SurfaceLayer::quantum_m()] times weights; > 0 in front of the surface.
  std::array<std::int32_t, kBrickVoxels> weighted_distance{};
  std::array<std::uint16_t, kBrickVoxels> weight{};
  std::array<std::uint16_t, kBrickVoxels> views{};
  /// Red | green << 21 | blue << 42.
  std::array<std::uint64_t, kBrickVoxels> colour{};

  bool operator==(const SurfaceBrick&) const = default;
  [[nodiscard]] Rgb8 mean_colour(int voxel) const;
};

/// Bricks that are handed out and come back as they were made: empty. For several threads.
class BrickPool {
 public:
  [[nodiscard]] SurfaceBrick* obtain();
  void release(SurfaceBrick* brick);
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  // so that it can be moved
  std::vector<std::unique_ptr<SurfaceBrick[]>> chunks_;
  std::vector<SurfaceBrick*> free_;
};

/// A voxel's place: its brick and the place in it.
struct VoxelPlace {
  std::size_t brick = 0;  ///< x half | y half << 1 | z half << 2
  int voxel = 0;
};
/// @param x, y, z of the voxel in its block, 0 to 7.
[[nodiscard]] constexpr VoxelPlace voxel_place(int x, int y, int z) {
  return {static_cast<std::size_t>((x >> 2) | (y >> 2) << 1 | (z >> 2) << 2),
          ((z & 3) * kBrickSide + (y & 3)) * kBrickSide + (x & 3)};
}

struct SurfaceBlock {
  /// A brick exists if and only if a view contributes to it.
  std::array<SurfaceBrick*, 8> bricks{};
  std::array<std::uint32_t, 8> contributions{};  ///< of each brick: sum of views
  /// In ascending order of objects, none without a vote. A view that does not vote for any object
  /// has seen something else there, one that votes for kUnsureObject does not know.
  std::vector<ObjectVotes> votes;
  std::uint64_t revision = 0;  ///< SurfaceLayer::revision() of the last change

  [[nodiscard]] bool empty() const { return contributions == std::array<std::uint32_t, 8>{}; }
  void vote(SceneObjectId object, int offset, int sign);
  /// @param views of the voxel at cell_offset `offset`. @return the object with most votes there,
  /// the lowest number among equals, and its share of the views that know; kNoSceneObject where
  /// more of them voted for none.
  [[nodiscard]] SurfaceLabel label(int offset, int views) const;
};

/// What is known of a voxel.
struct Voxel {
  float distance_m = 0;  ///< mean, > 0 in front of the surface
  int views = 0;         ///< > 0
  Rgb8 colour;
  SurfaceLabel label;  ///< without a class
};

class SurfaceLayer {
 public:
  SurfaceLayer(const SurfaceConfig& config, const DepthNoise& noise);

  /// Adds (sign 1) or takes back (sign -1) what a view at a pose contributes. What is taken back
  /// must have been added.
  void fuse(const PreparedView& view, const SE3& T_world_camera, int sign, int threads);
  /// Takes back what `old` contributed and adds what `now` does, a view of which other pixels count
  /// or show other objects. To the bit as fuse() of both; blocks that no such pixel reaches are
  /// left alone.
  void exchange(const PreparedView& old, const PreparedView& now, const SE3& T_world_camera,
                int threads);
  /// Takes everything back at once; the memory stays for what comes.
  void clear();

  [[nodiscard]] const SurfaceConfig& config() const { return config_; }
  [[nodiscard]] double quantum_m() const { return quantum_m_; }
  /// Counts changes.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  [[nodiscard]] const BlockStore<SurfaceBlock>& blocks() const { return blocks_; }
  /// @param index of a voxel: covers [index, index + 1) * voxel_m. @return nothing where no view
  /// saw a surface near.
  [[nodiscard]] std::optional<Voxel> voxel(const Eigen::Vector3i& index) const;
  [[nodiscard]] std::size_t memory_bytes() const;
  /// Of what is in the blocks, in whatever order it came.
  [[nodiscard]] std::uint64_t fingerprint() const;

 private:
  void find_touched(const PreparedView& view, const SE3& T_world_camera, BlockSet& touched) const;
  void fuse_blocks(const PreparedView& view, const SE3& T_world_camera, int sign, int threads,
                   std::span<const BlockKey> keys);

  SurfaceConfig config_;
  DepthNoise noise_;
  double quantum_m_;
  BrickPool bricks_;
  BlockStore<SurfaceBlock> blocks_;
  std::uint64_t revision_ = 0;
  BlockSet touched_, touched_before_, reached_;  // by the views being fused
};

}  // namespace ygslam
