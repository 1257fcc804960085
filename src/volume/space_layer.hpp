// Space: where views hit a surface and where they saw through, in blocks of 8^3 coarse cells. As in
// the surface layer all sums are whole numbers and a block exists if and only if a view counted
// something in it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/se3.hpp"
#include "scene/scene.hpp"
#include "volume/block_store.hpp"
#include "volume/prepared_view.hpp"

namespace ygslam {

struct SpaceConfig {
  double cell_m = 0.05;
  double margin_sigmas = 3;   ///< a cell is seen through if the depth lies farther behind it than
  double margin_cells = 0.5;  ///< this, and than this
};

/// Views by cell; cell (x, y, z) of the block stands at cell_offset(x, y, z).
struct alignas(64) SpaceBlock {
  std::array<std::uint16_t, kBlockCells> hits{};
  std::array<std::uint16_t, kBlockCells> through{};
  std::uint32_t contributions = 0;  ///< sum of both
};

/// One bit for each cell of a block, rows along x as bytes.
struct CellMask {
  std::array<std::uint8_t, kBlockCells / kBlockSide> rows{};
};

/// Counts of a cell; both 0 = never observed.
struct SpaceCounts {
  int hits = 0, through = 0;

  /// OctoMap's: each hit counts .85, each view through -.41, the sum is bounded to [-2, 3.5].
  [[nodiscard]] float log_odds() const;
  [[nodiscard]] SpaceState state() const;
};

class SpaceLayer {
 public:
  SpaceLayer(const SpaceConfig& config, const DepthNoise& noise);

  /// Adds (sign 1) or takes back (sign -1) what a view at a pose counts: at most one hit or one
  /// view through for each cell. All depth carves, only pixels with a weight hit.
  void fuse(const PreparedView& view, const SE3& T_world_camera, int sign, int threads);

  [[nodiscard]] const SpaceConfig& config() const { return config_; }
  [[nodiscard]] const BlockStore<SpaceBlock>& blocks() const { return blocks_; }
  [[nodiscard]] SpaceCounts counts(const Eigen::Vector3i& cell) const;
  [[nodiscard]] SpaceCounts counts_at(const Vec3& p_world) const;
  [[nodiscard]] std::size_t memory_bytes() const { return blocks_.memory_bytes(); }
  [[nodiscard]] std::uint64_t fingerprint() const;

 private:
  void find_spared(const PreparedView& view);
  void find_hits(const PreparedView& view, const SE3& T_world_camera);
  void find_visible(const PreparedView& view, const SE3& T_world_camera);

  SpaceConfig config_;
  DepthNoise noise_;
  BlockStore<SpaceBlock> blocks_;
  BlockSet touched_;                               // by the view being fused
  BlockStore<CellMask> hit_cells_, spared_cells_;  // of the view being fused
};

}  // namespace ygslam
