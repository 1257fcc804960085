// What changed in a room without anybody naming it: a door that was shut, a carton that was carried
// off or put down. Counts of all views say what was there for the longest time, which is not what
// is there; so where views disagree the last ones decide. (Occupancy by
// rays: Hornung et al. 2013; changes found by free space in a TSDF: Fehr et al. 2017.)
#pragma once

#include <vector>

#include "core/time.hpp"
#include "volume/seen_space.hpp"
#include "volume/space_layer.hpp"

namespace ygslam {

struct SpaceChangesConfig {
  int agreeing_views = 3;  ///< views in a row, the last ones that saw a cell, that agree
  double settle_s = 2;     ///< that what came was seen: who walks by is no furniture
  int min_cells = 6;       ///< that touch and changed: single ones are edges
};

using SpaceIndex = Eigen::Vector3i;  ///< of a cell of the space layer

/// Cells that a view counted something in, for which `is_wanted(index, counts)` holds.
template <typename IsWanted>
[[nodiscard]] std::vector<SpaceIndex> cells_where(const SpaceLayer& space, IsWanted is_wanted) {
  std::vector<SpaceIndex> cells;
  for (const BlockKey key : space.blocks().keys()) {
    const SpaceBlock& block = *space.blocks().find(key);
    const SpaceIndex first = block_of(key) * kBlockSide;
    for (int offset = 0; offset < kBlockCells; ++offset) {
      const auto i = static_cast<std::size_t>(offset);
      if (block.hits[i] == 0 && block.through[i] == 0) continue;
      const SpaceIndex cell =
          first + SpaceIndex(offset % kBlockSide, offset / kBlockSide % kBlockSide,
                             offset / (kBlockSide * kBlockSide));
      if (is_wanted(cell, SpaceCounts{block.hits[i], block.through[i]})) cells.push_back(cell);
    }
  }
  return cells;
}

/// Cells of which the view says something, for which `is_wanted(index, seen_as)` holds.
template <typename IsWanted>
[[nodiscard]] std::vector<SpaceIndex> cells_where(const SeenSpace& seen, IsWanted is_wanted) {
  std::vector<SpaceIndex> cells;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const SpaceIndex first = block_of(seen.key(i)) * kBlockSide;
    const CellMask &hits = seen.hits(i), &through = seen.through(i);
    for (int offset = 0; offset < kBlockCells; ++offset) {
      const SpaceIndex at(offset % kBlockSide, offset / kBlockSide % kBlockSide,
                          offset / (kBlockSide * kBlockSide));
      const bool is_hit = hits.at(at.x(), at.y(), at.z());
      if (!is_hit && !through.at(at.x(), at.y(), at.z())) continue;
      if (is_wanted(first + at, is_hit ? CellObservation::kHit : CellObservation::kThrough))
        cells.push_back(first + at);
    }
  }
  return cells;
}

/// Those of sets that hang together (corners included) and have so many.
[[nodiscard]] std::vector<SpaceIndex> in_large_parts(const std::vector<SpaceIndex>& cells,
                                                     int min_cells);

/// Of cells that some views hit and others saw through: which are empty by now, and in which
/// something stands by now.
class SpaceChanges {
 public:
  SpaceChanges(const SpaceChangesConfig& config, const std::vector<SpaceIndex>& disputed);

  /// Those that no view decided yet.
  [[nodiscard]] const std::vector<SpaceIndex>& open() const { return open_; }
  /// @param view from the newest to the oldest.
  void step(const SeenSpace& view, Timestamp stamp);
  /// In parts that are large enough.
  [[nodiscard]] std::vector<SpaceIndex> removed() const;
  [[nodiscard]] std::vector<SpaceIndex> appeared() const;

 private:
  struct Agreement {  // that agree
    int views = 0;
    bool is_through = false;
    Timestamp newest;
  };
  /// @return whether the cell is decided.
  bool take(const SpaceIndex& cell, CellObservation seen, Timestamp stamp, Agreement& agreement);

  SpaceChangesConfig config_;
  std::vector<SpaceIndex> open_;
  std::vector<Agreement> agreements_;  // of the open ones
  std::vector<SpaceIndex> removed_, appeared_;
};

}  // namespace ygslam
