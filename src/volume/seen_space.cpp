#include "volume/seen_space.hpp"

#include <algorithm>

namespace ygslam {

SeenSpace::SeenSpace() { clear(); }

void SeenSpace::clear() {
  CellMask full;
  full.rows.fill(0xff);
  blocks_.clear();
  masks_.assign({CellMask{}, full});
}

std::uint32_t SeenSpace::place_of(const CellMask& mask) {
  for (const std::uint32_t shared : {0U, 1U})
    if (mask == masks_[shared]) return shared;
  masks_.push_back(mask);
  return static_cast<std::uint32_t>(masks_.size() - 1);
}

void SeenSpace::add(BlockKey key, const CellMask& hits, const CellMask& through) {
  CHECK(blocks_.empty() || blocks_.back().key < key);
  const std::uint32_t its_hits = place_of(hits), its_through = place_of(through);
  if (its_hits != 0 || its_through != 0) blocks_.push_back({key, its_hits, its_through});
}

CellObservation SeenSpace::at(const Eigen::Vector3i& cell) const {
  const BlockKey key = block_key({cell.x() >> 3, cell.y() >> 3, cell.z() >> 3});
  const auto found = std::lower_bound(blocks_.begin(), blocks_.end(), key,
                                      [](const Block& block, BlockKey k) { return block.key < k; });
  if (found == blocks_.end() || found->key != key) return CellObservation::kNothing;
  const int x = cell.x() & 7, y = cell.y() & 7, z = cell.z() & 7;
  if (masks_[found->hits].at(x, y, z)) return CellObservation::kHit;
  return masks_[found->through].at(x, y, z) ? CellObservation::kThrough : CellObservation::kNothing;
}

}  // namespace ygslam
