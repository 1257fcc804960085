#include "dense/ground_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "scene/floor_frame.hpp"

namespace ygslam {
namespace {

constexpr double kSameCos = 0.99998;  // 0.36 degrees: 3 cm at 5 m
constexpr double kSameFloor_m = 0.015;
constexpr std::uint8_t kMostThrough = 3;
constexpr int kHalfACell = 4;  // eighths

/// In tiles. A camera that was placed a kilometre off must not take all the memory.
bool is_too_large(std::int64_t width, std::int64_t height) {
  constexpr std::int64_t kMostTiles = std::int64_t{1} << 20;  // 40 m by 40 m are 10,000
  return width * height > kMostTiles;
}

/// That see through the cell in a row, the newest first.
std::uint8_t views_through(const Eigen::Vector3i& cell,
                           const std::vector<const SeenSpace*>& views) {
  std::uint8_t count = 0;
  for (const SeenSpace* view : views) {
    const CellObservation seen = view->at(cell);
    if (seen == CellObservation::kHit || count == kMostThrough) break;
    if (seen == CellObservation::kThrough) ++count;
  }
  return count;
}

int floored(double x) { return static_cast<int>(std::floor(x)); }

}  // namespace

/// Eighths of a cell of the space layer in the floor's frame, in cells. A cell that stands askew
/// touches several columns: an eighth of it is laid at a time, so that none is left out.
struct GroundPlan::Lattice {
  Lattice(const SE3& T_floor_world, double cell_m) : R(T_floor_world.R()) {
    origin = T_floor_world.t() / cell_m;
    for (std::size_t i = 0; i < offsets.size(); ++i)
      offsets[i] = R * Vec3((i & 1) ? 0.25 : -0.25, (i & 2) ? 0.25 : -0.25, (i & 4) ? 0.25 : -0.25);
  }
  [[nodiscard]] Vec3 centre(const Eigen::Vector3i& cell) const {
    return R * (cell.cast<double>() + Vec3::Constant(0.5)) + origin;
  }
  Mat3 R;
  Vec3 origin;
  std::array<Vec3, 8> offsets;
};

int GroundPlan::layers() const {
  return static_cast<int>(std::ceil((config_.high_m - config_.low_m) / cell_m_ - 1e-6));
}

void GroundPlan::observe(const SeenSpace& seen) {
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto found = blocks_.find(seen.key(i));
    if (found == blocks_.end()) continue;
    Block& block = found->second;
    const CellMask &hits = seen.hits(i), &through = seen.through(i);
    for (std::size_t row = 0; row < hits.rows.size(); ++row) {
      const unsigned hit = hits.rows[row], free = through.rows[row];
      if ((hit | free) == 0) continue;
      std::uint8_t* views = block.through.data() + row * kBlockSide;
      for (unsigned k = 0; k < kBlockSide; ++k) {
        if ((hit >> k & 1U) != 0) views[k] = 0;
        if ((free >> k & 1U) != 0 && views[k] < kMostThrough) ++views[k];
      }
    }
    observed_.push_back(seen.key(i));
  }
}

void GroundPlan::reobserve(const SeenSpace& seen, const std::vector<const SeenSpace*>& later) {
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto found = blocks_.find(seen.key(i));
    if (found == blocks_.end()) continue;
    const CellMask& hits = seen.hits(i);
    const Eigen::Vector3i first = block_of(seen.key(i)) * kBlockSide;
    for (int offset = 0; offset < kBlockCells; ++offset) {
      const Eigen::Vector3i at(offset % 8, offset / 8 % 8, offset / 64);
      std::uint8_t& through = found->second.through[static_cast<std::size_t>(offset)];
      if (through > 0 && hits.at(at.x(), at.y(), at.z()))
        through = views_through(first + at, later);
    }
    observed_.push_back(seen.key(i));
  }
}

void GroundPlan::set_floor(const Gravity& gravity) {
  const Vec3 up = gravity.up_world.normalized();
  if (floor_ && floor_->up_world.dot(up) > kSameCos &&
      std::abs(floor_->floor_m - gravity.floor_m) < kSameFloor_m)
    return;
  floor_ = gravity;
  floor_->up_world = up;
  T_world_floor_ = ygslam::T_world_floor(gravity);
  is_built_ = false;
}

GroundPlan::CellState GroundPlan::known(const SpaceCounts& counts, int through) const {
  if (counts.hits == 0) return counts.through > 0 ? CellState::kFree : CellState::kNothing;
  if (through >= (counts.hits <= config_.young_hits ? 1 : 2)) return CellState::kFree;
  if (counts.state() == SpaceState::kFree) return CellState::kFree;
  return counts.hits >= config_.min_views ? CellState::kOccupied : CellState::kNothing;
}

void GroundPlan::update(const SpaceLayer& space, const std::vector<BlockKey>& changed) {
  cell_m_ = space.config().cell_m;
  if (floor_ && !is_built_) return rebuild(space, changed);
  // Without a floor there are no columns, but views in a row count.
  const Lattice lattice(T_world_floor_.inverse(), cell_m_);
  observed_.insert(observed_.end(), changed.begin(), changed.end());
  std::sort(observed_.begin(), observed_.end());
  observed_.erase(std::unique(observed_.begin(), observed_.end()), observed_.end());
  for (const BlockKey key : observed_) project(lattice, space, key);
  observed_.clear();
  for (auto& [key, tile] : tiles_) {
    if (!std::exchange(tile.is_changed, false)) continue;
    for (int column = 0; column < kSide * kSide; ++column)
      tile.state[static_cast<std::size_t>(column)] = judged(tile, column);
  }
}

void GroundPlan::rebuild(const SpaceLayer& space, const std::vector<BlockKey>& changed) {
  tiles_.clear();
  for (auto& [key, block] : blocks_) block.known.fill(CellState::kNothing);
  is_built_ = true;
  std::vector<BlockKey> all = space.blocks().keys();
  all.insert(all.end(), changed.begin(), changed.end());  // released ones, too
  update(space, all);
}

/// Exchanges what was laid of the block's cells for what is known of them now.
void GroundPlan::project(const Lattice& lattice, const SpaceLayer& space, BlockKey key) {
  const SpaceBlock* counted = space.blocks().find(key);
  Block& block = blocks_[key];
  const Eigen::Vector3i first = block_of(key) * kBlockSide;
  const int count = layers();
  const double low = config_.low_m / cell_m_, floor_seen = config_.floor_seen_m / cell_m_;
  for (int offset = 0; offset < kBlockCells; ++offset) {
    const auto i = static_cast<std::size_t>(offset);
    const CellState now = counted == nullptr ? CellState::kNothing
                                             : known({counted->hits[i], counted->through[i]},
                                                     static_cast<int>(block.through[i]));
    const CellState before = std::exchange(block.known[i], now);
    if (now == before || !floor_) continue;
    const Vec3 centre =
        lattice.centre(first + Eigen::Vector3i(offset % 8, offset / 8 % 8, offset / 64));
    if (centre.z() < -floor_seen - 1 || centre.z() > low + count + 1) continue;
    for (const Vec3& part : lattice.offsets) {
      const Vec3 p = centre + part;
      add_part(p, before, -1);
      add_part(p, now, 1);
    }
  }
  if (counted == nullptr) blocks_.erase(key);
}

/// @param p in the floor's frame, in cells. @param count 1 or -1.
void GroundPlan::add_part(const Vec3& p, CellState what, int count) {
  const double floor_seen = config_.floor_seen_m / cell_m_;
  const int layer = floored(p.z() - config_.low_m / cell_m_);
  if (p.z() < -floor_seen || layer >= layers()) return;
  const int x = floored(p.x()), y = floored(p.y());
  Tile& tile = this->tile(x, y);
  tile.is_changed = true;
  if (what == CellState::kNothing) return;
  const auto column = static_cast<std::size_t>((y & (kSide - 1)) * kSide + (x & (kSide - 1)));
  const bool is_free = what == CellState::kFree;
  if (layer >= 0) {
    const std::size_t at =
        column * static_cast<std::size_t>(layers()) + static_cast<std::size_t>(layer);
    const bool upper = p.z() - config_.low_m / cell_m_ - layer >= 0.5;
    std::uint8_t& parts = is_free ? tile.free[2 * at + (upper ? 1 : 0)] : tile.occupied[at];
    parts = static_cast<std::uint8_t>(parts + count);
  }
  // A floor that was laid a little too high or too low is one all the same.
  if (is_free ? p.z() < floor_seen : layer < 0)
    tile.floor[column] = static_cast<std::uint16_t>(tile.floor[column] + count);
}

GroundPlan::Tile& GroundPlan::tile(int x, int y) {
  Tile& tile = tiles_[block_key({x >> 3, y >> 3, 0})];
  if (tile.free.empty()) {
    const auto count = static_cast<std::size_t>(kSide * kSide * layers());
    tile.free.assign(2 * count, 0);
    tile.occupied.assign(count, 0);
    tile.state.fill(GroundState::kUnknown);
  }
  return tile;
}

GroundState GroundPlan::judged(const Tile& tile, int column) const {
  const int count = layers();
  const auto first = static_cast<std::ptrdiff_t>(column) * count;
  const auto occupied = tile.occupied.begin() + first;
  if (std::any_of(occupied, occupied + count, [](std::uint8_t parts) { return parts > 0; }))
    return GroundState::kOccupied;
  if (tile.floor[static_cast<std::size_t>(column)] == 0) return GroundState::kUnknown;
  // By halves of layers: a cell that nobody saw may lie half in one layer and half in the next, or
  // askew in three halves, each of which has free parts of the cells above and below it.
  const int window = std::max(1, floored(2 * config_.hidden_m / cell_m_ + 1e-6));
  const auto free = tile.free.begin() + 2 * first;
  int parts = 0;
  for (int half = 0; half < 2 * count; ++half) {
    parts += free[half] - (half < window ? 0 : free[half - window]);
    if (half + 1 >= window && parts <= kHalfACell) return GroundState::kUnknown;
  }
  return GroundState::kFree;
}

GroundGrid GroundPlan::grid() const {
  GroundGrid grid;
  grid.T_world_floor = T_world_floor_;
  grid.cell_m = cell_m_;
  int left = std::numeric_limits<int>::max(), bottom = left, right = -left, top = -left;
  const auto is_known = [](const Tile& tile) {
    return std::any_of(tile.state.begin(), tile.state.end(),
                       [](GroundState state) { return state != GroundState::kUnknown; });
  };
  for (const auto& [key, tile] : tiles_) {
    if (!is_known(tile)) continue;
    const Eigen::Vector3i at = block_of(key);
    left = std::min(left, at.x());
    right = std::max(right, at.x());
    bottom = std::min(bottom, at.y());
    top = std::max(top, at.y());
  }
  if (left > right || is_too_large(right - left + 1, top - bottom + 1)) return grid;
  grid.width = (right - left + 1) * kSide;
  grid.height = (top - bottom + 1) * kSide;
  grid.origin_floor = Vec2(left, bottom) * kSide * cell_m_;
  grid.cells.assign(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height),
                    GroundState::kUnknown);
  for (const auto& [key, tile] : tiles_) {
    const Eigen::Vector3i at = block_of(key);
    if (at.x() < left || at.x() > right || at.y() < bottom || at.y() > top) continue;
    const int x = (at.x() - left) * kSide, y = (at.y() - bottom) * kSide;
    for (int row = 0; row < kSide; ++row)
      std::copy_n(tile.state.begin() + row * kSide, kSide,
                  grid.cells.begin() + static_cast<std::ptrdiff_t>(y + row) * grid.width + x);
  }
  return grid;
}

std::size_t GroundPlan::memory_bytes() const {
  std::size_t bytes = blocks_.size() * sizeof(Block) + observed_.capacity() * sizeof(BlockKey);
  for (const auto& [key, tile] : tiles_)
    bytes += sizeof(Tile) + tile.free.capacity() + tile.occupied.capacity();
  return bytes;
}

}  // namespace ygslam
