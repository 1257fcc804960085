// Space: where views hit a surface and where they saw through, in blocks of 8^3 coarse cells. As in
// the surface layer all sums are whole numbers and a block exists if and only if a view counted
// something in it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/scene.hpp"
#include "volume/block_store.hpp"
#include "volume/seen_space.hpp"
#include "volume/space_scan.hpp"

namespace ygslam {

/// Views by cell; cell (x, y, z) of the block stands at cell_offset(x, y, z).
struct alignas(64) SpaceBlock {
  std::array<std::uint16_t, kBlockCells> hits{};
  std::array<std::uint16_t, kBlockCells> through{};
  std::uint32_t contributions = 0;  ///< sum of both
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
  explicit SpaceLayer(const SpaceConfig& config);

  /// Adds (sign 1) or takes back (sign -1) what a view counts: at most one hit or one view through
  /// for each cell.
  /// @param spared cells that it does not carve: DepthView::spared.
  void count(const SeenSpace& seen, const std::vector<Eigen::Vector3i>& spared, int sign,
             int threads);
  /// Takes everything back at once; the memory stays for what comes.
  void clear();

  /// Blocks in which something was counted or taken back since the last call, in no order.
  [[nodiscard]] std::vector<BlockKey> take_changed();

  [[nodiscard]] const SpaceConfig& config() const { return config_; }
  [[nodiscard]] const BlockStore<SpaceBlock>& blocks() const { return blocks_; }
  [[nodiscard]] SpaceCounts counts(const Eigen::Vector3i& cell) const;
  [[nodiscard]] SpaceCounts counts_at(const Vec3& p_world) const;
  [[nodiscard]] std::size_t memory_bytes() const { return blocks_.memory_bytes(); }
  [[nodiscard]] std::uint64_t fingerprint() const;

 private:
  SpaceConfig config_;
  BlockStore<SpaceBlock> blocks_;
  BlockSet changed_;
};

}  // namespace ygslam
