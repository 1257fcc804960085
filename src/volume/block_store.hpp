// Cubes of 8 x 8 x 8 cells, found by their place: a flat hash table over a pool.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/check.hpp"

namespace ygslam {

inline constexpr int kBlockSide = 8;
inline constexpr int kBlockCells = kBlockSide * kBlockSide * kBlockSide;

/// A block's place; ascending in (z, y, x). Block b covers cells [8 b, 8 b + 8) along each axis.
using BlockKey = std::uint64_t;
inline constexpr int kBlockBits = 21;
inline constexpr int kBlockBias = 1 << (kBlockBits - 1);

/// @param block each coordinate in [-kBlockBias, kBlockBias).
[[nodiscard]] inline BlockKey block_key(const Eigen::Vector3i& block) {
  const auto part = [](int i) { return static_cast<BlockKey>(i + kBlockBias); };
  return (part(block.z()) << (2 * kBlockBits)) | (part(block.y()) << kBlockBits) | part(block.x());
}
[[nodiscard]] inline Eigen::Vector3i block_of(BlockKey key) {
  const auto part = [key](int shift) {
    return static_cast<int>((key >> shift) & ((1 << kBlockBits) - 1)) - kBlockBias;
  };
  return {part(0), part(kBlockBits), part(2 * kBlockBits)};
}
inline constexpr std::uint64_t kHashFactor = 0x9e3779b97f4a7c15ULL;
/// Of a cell by its place in the block, each coordinate 0 to 7.
[[nodiscard]] constexpr int cell_offset(int x, int y, int z) {
  return (z * kBlockSide + y) * kBlockSide + x;
}

/// Places, each once.
class BlockSet {
 public:
  BlockSet() : slots_(kFirstSlots, kFree) {}
  void insert(BlockKey key) {
    std::size_t i = first_slot(key);
    for (; slots_[i] != kFree; i = (i + 1) & (slots_.size() - 1))
      if (slots_[i] == key) return;
    slots_[i] = key;
    keys_.push_back(key);
    if (2 * keys_.size() > slots_.size()) refill(2 * slots_.size());
  }
  [[nodiscard]] bool contains(BlockKey key) const {
    std::size_t i = first_slot(key);
    while (slots_[i] != kFree && slots_[i] != key) i = (i + 1) & (slots_.size() - 1);
    return slots_[i] == key;
  }
  void clear() {
    keys_.clear();
    std::fill(slots_.begin(), slots_.end(), kFree);
  }
  /// In the order they were first inserted.
  [[nodiscard]] const std::vector<BlockKey>& keys() const { return keys_; }

 private:
  static constexpr BlockKey kFree = ~BlockKey{0};  // block_key() leaves the highest bit unset
  static constexpr std::size_t kFirstSlots = 4096;
  [[nodiscard]] std::size_t first_slot(BlockKey key) const {
    return static_cast<std::size_t>((key * kHashFactor) >> 32) & (slots_.size() - 1);
  }
  void refill(std::size_t size) {
    slots_.assign(size, kFree);
    for (const BlockKey key : keys_) {
      std::size_t i = first_slot(key);
      while (slots_[i] != kFree) i = (i + 1) & (size - 1);
      slots_[i] = key;
    }
  }

  std::vector<BlockKey> slots_;
  std::vector<BlockKey> keys_;
};

/// @tparam Block default-constructible; one that is released must be as if default-constructed.
/// Blocks never move. Not for several threads, except for find().
template <typename Block>
class BlockStore {
 public:
  BlockStore() : slots_(kFirstSlots) {}

  [[nodiscard]] Block* find(BlockKey key) {
    return const_cast<Block*>(static_cast<const BlockStore*>(this)->find(key));
  }
  [[nodiscard]] const Block* find(BlockKey key) const {
    for (std::size_t i = first_slot(key);; i = next(i)) {
      if (slots_[i].index == kEmpty) return nullptr;
      if (slots_[i].key == key) return &at(slots_[i].index);
    }
  }

  /// The block of that place, made where there is none.
  [[nodiscard]] Block& obtain(BlockKey key) {
    std::size_t i = first_slot(key);
    for (; slots_[i].index != kEmpty; i = next(i))
      if (slots_[i].key == key) return at(slots_[i].index);
    if (2 * (size_ + 1) > slots_.size()) {
      grow();
      for (i = first_slot(key); slots_[i].index != kEmpty;) i = next(i);
    }
    if (free_.empty()) add_chunk();
    slots_[i] = {key, free_.back()};
    free_.pop_back();
    ++size_;
    return at(slots_[i].index);
  }

  /// Gives the block of that place back, which must exist.
  void release(BlockKey key) {
    std::size_t hole = first_slot(key);
    while (slots_[hole].key != key || slots_[hole].index == kEmpty) {
      CHECK(slots_[hole].index != kEmpty);
      hole = next(hole);
    }
    free_.push_back(slots_[hole].index);
    --size_;
    // Linear probing without tombstones: what was pushed past the hole moves back into it.
    for (std::size_t i = next(hole); slots_[i].index != kEmpty; i = next(i)) {
      const std::size_t wanted = first_slot(slots_[i].key);
      if (((i - wanted) & mask()) < ((i - hole) & mask())) continue;
      slots_[hole] = slots_[i];
      hole = i;
    }
    slots_[hole].index = kEmpty;
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  /// In ascending order.
  [[nodiscard]] std::vector<BlockKey> keys() const {
    std::vector<BlockKey> keys;
    keys.reserve(size_);
    for (const Slot& slot : slots_)
      if (slot.index != kEmpty) keys.push_back(slot.key);
    std::sort(keys.begin(), keys.end());
    return keys;
  }
  /// The pool, with blocks that wait for the next use, and the table.
  [[nodiscard]] std::size_t memory_bytes() const {
    return chunks_.size() * kChunk * sizeof(Block) + slots_.size() * sizeof(Slot) +
           free_.capacity() * sizeof(std::uint32_t);
  }

 private:
  static constexpr std::uint32_t kEmpty = 0xffffffffU;
  static constexpr std::size_t kFirstSlots = 1024;
  static constexpr std::size_t kChunk = 64;  // blocks made at once

  struct Slot {
    BlockKey key = 0;
    std::uint32_t index = kEmpty;
  };

  [[nodiscard]] std::size_t mask() const { return slots_.size() - 1; }
  [[nodiscard]] std::size_t next(std::size_t i) const { return (i + 1) & mask(); }
  [[nodiscard]] std::size_t first_slot(BlockKey key) const {
    return static_cast<std::size_t>((key * kHashFactor) >> 32) & mask();
  }
  [[nodiscard]] Block& at(std::uint32_t index) { return chunks_[index / kChunk][index % kChunk]; }
  [[nodiscard]] const Block& at(std::uint32_t index) const {
    return chunks_[index / kChunk][index % kChunk];
  }
  void add_chunk() {
    const std::size_t first = chunks_.size() * kChunk;
    chunks_.push_back(std::make_unique<Block[]>(kChunk));
    for (std::size_t i = kChunk; i-- > 0;) free_.push_back(static_cast<std::uint32_t>(first + i));
  }
  void grow() {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.index == kEmpty) continue;
      std::size_t i = first_slot(slot.key);
      while (slots_[i].index != kEmpty) i = next(i);
      slots_[i] = slot;
    }
  }

  std::vector<Slot> slots_;
  std::vector<std::unique_ptr<Block[]>> chunks_;
  std::vector<std::uint32_t> free_;
  std::size_t size_ = 0;
};

}  // namespace ygslam
