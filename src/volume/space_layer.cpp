#include "volume/space_layer.hpp"

#include <algorithm>

#include "core/check.hpp"
#include "core/content_hash.hpp"
#include "core/parallel.hpp"

namespace ygslam {
namespace {

// Hundredths of OctoMap's log-odds (Hornung et al. 2013: .7 for a hit, .4 for a miss).
constexpr int kHit = 85, kMiss = -41, kLeast = -200, kMost = 350;
constexpr int kSpaceBlocksAtOnce = 16;

int evidence(const SpaceCounts& counts) {
  return std::clamp(kHit * counts.hits + kMiss * counts.through, kLeast, kMost);
}

/// Adds or subtracts one where the mask has a bit.
int count_row(std::uint16_t* counts, std::uint8_t mask, int sign) {
  int bits = 0;
  for (int k = 0; k < kBlockSide; ++k) {
    const int bit = (mask >> k) & 1;
    counts[k] = static_cast<std::uint16_t>(counts[k] + sign * bit);
    bits += bit;
  }
  return bits;
}

}  // namespace

float SpaceCounts::log_odds() const { return static_cast<float>(evidence(*this)) * 0.01F; }

SpaceState SpaceCounts::state() const {
  if (hits == 0 && through == 0) return SpaceState::kUnknown;
  return evidence(*this) >= 0 ? SpaceState::kOccupied : SpaceState::kFree;
}

SpaceLayer::SpaceLayer(const SpaceConfig& config) : config_(config) {}

void SpaceLayer::count(const SeenSpace& seen, const std::vector<Eigen::Vector3i>& spared, int sign,
                       int threads) {
  CHECK(sign == 1 || sign == -1);
  BlockStore<CellMask> spared_cells;
  for (const Eigen::Vector3i& cell : spared)
    spared_cells.obtain(block_key({cell.x() >> 3, cell.y() >> 3, cell.z() >> 3}))
        .set(cell.x() & 7, cell.y() & 7, cell.z() & 7);
  const int count = static_cast<int>(seen.size());
  std::vector<SpaceBlock*> blocks(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i)
    blocks[i] = sign > 0 ? &blocks_.obtain(seen.key(i)) : blocks_.find(seen.key(i));
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (blocks[i] != nullptr) changed_.insert(seen.key(i));
  const CellMask none;
  parallel_for((count + kSpaceBlocksAtOnce - 1) / kSpaceBlocksAtOnce, threads, [&](int chunk) {
    const int end = std::min((chunk + 1) * kSpaceBlocksAtOnce, count);
    for (int k = chunk * kSpaceBlocksAtOnce; k < end; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (blocks[i] == nullptr) continue;
      SpaceBlock& block = *blocks[i];
      const CellMask *found = spared_cells.find(seen.key(i)), &spare = found ? *found : none;
      const CellMask &hits = seen.hits(i), &through = seen.through(i);
      int cells = 0;
      for (std::size_t row = 0; row < hits.rows.size(); ++row) {
        const auto free = static_cast<std::uint8_t>(through.rows[row] & ~spare.rows[row]);
        if (hits.rows[row] != 0)
          cells += count_row(block.hits.data() + row * kBlockSide, hits.rows[row], sign);
        if (free != 0) cells += count_row(block.through.data() + row * kBlockSide, free, sign);
      }
      CHECK(sign > 0 || block.contributions >= static_cast<std::uint32_t>(cells),
            "a view taken back that was never added");
      block.contributions += static_cast<std::uint32_t>(sign * cells);
    }
  });
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (blocks[i] != nullptr && blocks[i]->contributions == 0) blocks_.release(seen.key(i));
}

void SpaceLayer::clear() {
  for (const BlockKey key : blocks_.keys()) {
    *blocks_.find(key) = {};
    blocks_.release(key);
    changed_.insert(key);
  }
}

std::vector<BlockKey> SpaceLayer::take_changed() {
  std::vector<BlockKey> changed = changed_.keys();
  changed_.clear();
  return changed;
}

SpaceCounts SpaceLayer::counts(const Eigen::Vector3i& cell) const {
  const Eigen::Vector3i block(cell.x() >> 3, cell.y() >> 3, cell.z() >> 3);
  const SpaceBlock* found = blocks_.find(block_key(block));
  if (found == nullptr) return {};
  const auto i = static_cast<std::size_t>(cell_offset(cell.x() & 7, cell.y() & 7, cell.z() & 7));
  return {found->hits[i], found->through[i]};
}

SpaceCounts SpaceLayer::counts_at(const Vec3& p_world) const {
  return counts((p_world / config_.cell_m).array().floor().cast<int>());
}

std::uint64_t SpaceLayer::fingerprint() const {
  ContentHash hash;
  for (const BlockKey key : blocks_.keys()) {
    const SpaceBlock& block = *blocks_.find(key);
    hash.add(key);
    hash.add_all(block.hits);
    hash.add_all(block.through);
  }
  return hash.value();
}

}  // namespace ygslam
