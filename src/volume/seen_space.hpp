// What one view at a pose says of space by itself: cells that its surface lies in, and cells that
// it saw through.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "volume/block_store.hpp"

namespace ygslam {

/// One bit for each cell of a block, rows along x as bytes.
struct CellMask {
  std::array<std::uint8_t, kBlockCells / kBlockSide> rows{};

  [[nodiscard]] bool at(int x, int y, int z) const {
    return ((rows[static_cast<std::size_t>(z * kBlockSide + y)] >> x) & 1) != 0;
  }
  void set(int x, int y, int z) {
    std::uint8_t& row = rows[static_cast<std::size_t>(z * kBlockSide + y)];
    row = static_cast<std::uint8_t>(row | (1U << x));
  }
  friend bool operator==(const CellMask&, const CellMask&) = default;
};

enum class CellObservation { kNothing, kHit, kThrough };

/// Most blocks are seen through as a whole: such masks are kept once.
class SeenSpace {
 public:
  SeenSpace();

  void clear();
  /// @param key greater than all before. @param hits, through no cell in both.
  void add(BlockKey key, const CellMask& hits, const CellMask& through);

  [[nodiscard]] std::size_t size() const { return blocks_.size(); }
  [[nodiscard]] BlockKey key(std::size_t i) const { return blocks_[i].key; }
  [[nodiscard]] const CellMask& hits(std::size_t i) const { return masks_[blocks_[i].hits]; }
  [[nodiscard]] const CellMask& through(std::size_t i) const { return masks_[blocks_[i].through]; }
  [[nodiscard]] CellObservation at(const Eigen::Vector3i& cell) const;
  [[nodiscard]] std::size_t memory_bytes() const {
    return blocks_.capacity() * sizeof(Block) + masks_.capacity() * sizeof(CellMask);
  }

 private:
  struct Block {
    BlockKey key;
    std::uint32_t hits, through;  // where their masks are
  };
  std::uint32_t place_of(const CellMask& mask);

  std::vector<Block> blocks_;
  std::vector<CellMask> masks_;  // the first is empty, the second full
};

}  // namespace ygslam
