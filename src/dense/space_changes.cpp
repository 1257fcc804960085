#include "dense/space_changes.hpp"

#include <array>
#include <cmath>
#include <map>

namespace ygslam {
namespace {

using Order = std::array<int, 3>;
Order order_of(const SpaceIndex& cell) { return {cell.x(), cell.y(), cell.z()}; }

}  // namespace

std::vector<SpaceIndex> in_large_parts(const std::vector<SpaceIndex>& cells, int min_cells) {
  std::map<Order, bool> is_open;
  for (const SpaceIndex& cell : cells) is_open.emplace(order_of(cell), true);
  std::vector<SpaceIndex> kept;
  for (const SpaceIndex& seed : cells) {
    std::vector<SpaceIndex> part;
    const auto take = [&](const SpaceIndex& cell) {
      const auto found = is_open.find(order_of(cell));
      if (found == is_open.end() || !found->second) return;
      found->second = false;
      part.push_back(cell);
    };
    take(seed);
    for (std::size_t next = 0; next < part.size(); ++next) {
      const SpaceIndex at = part[next];
      for (int n = 0; n < 27; ++n) take(at + SpaceIndex(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
    }
    if (std::ssize(part) >= min_cells) kept.insert(kept.end(), part.begin(), part.end());
  }
  return kept;
}

SpaceChanges::SpaceChanges(const SpaceChangesConfig& config,
                           const std::vector<SpaceIndex>& disputed)
    : config_(config),
      open_(in_large_parts(disputed, config.min_cells)),
      agreements_(open_.size()) {}

bool SpaceChanges::take(const SpaceIndex& cell, CellObservation seen, Timestamp stamp,
                        Agreement& agreement) {
  if (seen == CellObservation::kNothing) return false;
  const bool is_through = seen == CellObservation::kThrough;
  if (agreement.views == 0) agreement = {0, is_through, stamp};
  if (agreement.is_through != is_through) return true;  // they do not agree: counts decide
  ++agreement.views;
  if (agreement.views < config_.agreeing_views) return false;
  if (is_through) {
    removed_.push_back(cell);
    return true;
  }
  if (std::abs(seconds_between(agreement.newest, stamp)) < config_.settle_s) return false;
  appeared_.push_back(cell);
  return true;
}

void SpaceChanges::step(const SeenSpace& view, Timestamp stamp) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < open_.size(); ++i) {
    if (take(open_[i], view.at(open_[i]), stamp, agreements_[i])) continue;
    open_[kept] = open_[i];
    agreements_[kept++] = agreements_[i];
  }
  open_.resize(kept);
  agreements_.resize(kept);
}

std::vector<SpaceIndex> SpaceChanges::removed() const {
  return in_large_parts(removed_, config_.min_cells);
}

std::vector<SpaceIndex> SpaceChanges::appeared() const {
  return in_large_parts(appeared_, config_.min_cells);
}

}  // namespace ygslam
