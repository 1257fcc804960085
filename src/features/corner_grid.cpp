#include "features/corner_grid.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <queue>
#include <tuple>

namespace ygslam {

namespace {

constexpr int kCell_px = 16;
constexpr int kMaxRadius_px = 100;
constexpr int kDuplicate_px2 = 6;
// A corner suppresses others only if it is stronger by more than noise (Brown et al. use the same).
constexpr float kClearly = 1.0F / 0.9F;

bool raster_before(const Corner& a, const Corner& b) {
  return std::tuple(a.v, a.u) < std::tuple(b.v, b.u);
}

// "Less" is better: higher rank, then earlier in raster order.
struct Ranked {
  double rank;
  Corner corner;
  bool operator<(const Ranked& other) const {
    return std::tuple(-rank, corner.v, corner.u) <
           std::tuple(-other.rank, other.corner.v, other.corner.u);
  }
};

int squared(int x) { return x * x; }

// Distance from a coordinate to the interval [begin, begin + kCell_px).
int outside(int x, int begin) { return std::max({begin - x, x - (begin + kCell_px - 1), 0}); }

// Those of a score above 0; of equal ones the first in raster order. Whole numbers are sorted: of
// floats above 0 the bits have the same order.
std::vector<Corner> strongest_first(std::span<const Corner> corners) {
  std::vector<std::uint64_t> keys;
  keys.reserve(corners.size());
  for (const Corner& c : corners)
    if (c.score > 0)
      keys.push_back(std::uint64_t{~std::bit_cast<std::uint32_t>(c.score)} << 32 |
                     static_cast<std::uint32_t>(c.v) << 16 | static_cast<std::uint32_t>(c.u));
  std::sort(keys.begin(), keys.end());
  std::vector<Corner> sorted;
  sorted.reserve(keys.size());
  for (const std::uint64_t key : keys)
    sorted.push_back({static_cast<std::int16_t>(key), static_cast<std::int16_t>(key >> 16),
                      std::bit_cast<float>(~static_cast<std::uint32_t>(key >> 32))});
  return sorted;
}

}  // namespace

CornerGrid::CornerGrid(std::span<const Corner> by_score) {
  for (const Corner& c : by_score) {
    columns_ = std::max(columns_, c.u / kCell_px + 1);
    rows_ = std::max(rows_, c.v / kCell_px + 1);
  }
  const auto cell_of = [&](const Corner& c) {
    return static_cast<std::size_t>(c.v / kCell_px * columns_ + c.u / kCell_px);
  };
  begin_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  for (const Corner& c : by_score) ++begin_[cell_of(c) + 1];
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  std::vector<std::uint32_t> next = begin_;
  corners_.resize(by_score.size());
  for (const Corner& c : by_score) corners_[next[cell_of(c)]++] = c;
}

int CornerGrid::nearest_in_cell_px2(int column, int row, const Corner& from, float score,
                                    int limit_px2) const {
  const std::size_t cell = static_cast<std::size_t>(row) * columns_ + column;
  int nearest = limit_px2;
  for (std::uint32_t k = begin_[cell]; k < begin_[cell + 1]; ++k) {
    const Corner& c = corners_[k];
    if (c.score < score) break;
    if (c.score == score && !raster_before(c, from)) continue;
    const int d = squared(c.u - from.u) + squared(c.v - from.v);
    if (d > 0) nearest = std::min(nearest, d);
  }
  return nearest;
}

int CornerGrid::nearest_stronger_px2(const Corner& from, float score, int limit_px2,
                                     int enough_px2) const {
  const int column = from.u / kCell_px;
  const int row = from.v / kCell_px;
  int nearest = nearest_in_cell_px2(column, row, from, score, limit_px2);
  const auto look = [&](int c, int r) {
    if (squared(outside(from.u, c * kCell_px)) + squared(outside(from.v, r * kCell_px)) < nearest)
      nearest = nearest_in_cell_px2(c, r, from, score, nearest);
  };
  // Cells in rings about its own; each ring lies farther out by a cell's side.
  const int u = from.u % kCell_px;
  const int v = from.v % kCell_px;
  int out_px = 1 + std::min({u, v, kCell_px - 1 - u, kCell_px - 1 - v});
  const int rings = std::max({column, row, columns_ - 1 - column, rows_ - 1 - row});
  for (int ring = 1; ring <= rings; ++ring, out_px += kCell_px) {
    if (nearest <= enough_px2 || squared(out_px) >= nearest) break;
    const int first = std::max(column - ring, 0);
    const int last = std::min(column + ring, columns_ - 1);
    for (int r = std::max(row - ring, 0); r <= std::min(row + ring, rows_ - 1); ++r) {
      const bool is_whole = r == row - ring || r == row + ring;
      if (is_whole) {
        for (int c = first; c <= last; ++c) look(c, r);
      } else {
        if (column - ring >= 0) look(column - ring, r);
        if (column + ring < columns_) look(column + ring, r);
      }
    }
  }
  return nearest;
}

std::vector<Corner> spread_corners(std::span<const Corner> corners, int quota, double evenness) {
  if (quota <= 0) return {};
  const std::vector<Corner> by_score = strongest_first(corners);
  const CornerGrid grid(by_score);
  // The best so far, the worst of them on top. Later corners are weaker: each must stand ever
  // farther from stronger ones to get in, and in the end none can.
  std::priority_queue<Ranked> best;
  for (const Corner& c : by_score) {
    const bool full = static_cast<int>(best.size()) == quota;
    double needed_px2 = 0;
    if (full) {
      if (evenness <= 0) break;
      needed_px2 = std::pow(best.top().rank / c.score, 1 / evenness);
      if (needed_px2 > squared(kMaxRadius_px) + 1) break;
    }
    const int r_px2 = grid.nearest_stronger_px2(c, c.score * kClearly, squared(kMaxRadius_px),
                                                static_cast<int>(needed_px2) - 1);
    const Ranked ranked{c.score * std::pow(static_cast<double>(r_px2), evenness), c};
    if (full && !(ranked < best.top())) continue;
    if (grid.nearest_stronger_px2(c, c.score, kDuplicate_px2, 0) < kDuplicate_px2) continue;
    if (full) best.pop();
    best.push(ranked);
  }
  std::vector<Corner> chosen;
  for (; !best.empty(); best.pop()) chosen.push_back(best.top().corner);
  std::sort(chosen.begin(), chosen.end(), raster_before);
  return chosen;
}

}  // namespace ygslam
