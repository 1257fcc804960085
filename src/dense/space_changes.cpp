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
    : config_(config), open_(in_large_parts(disputed, config.min_cells)), sights_(open_.size()) {}

bool SpaceChanges::take(const SpaceIndex& cell, SpaceSight seen, Timestamp stamp, Sights& sights) {
  if (seen == SpaceSight::kNothing) return false;
  const bool is_through = seen == SpaceSight::kThrough;
  if (sights.looks == 0) sights = {0, is_through, stamp};
  if (sights.is_through != is_through) return true;  // they do not agree: counts decide
  ++sights.looks;
  if (sights.looks < config_.looks) return false;
  if (is_through) {
    gone_.push_back(cell);
    return true;
  }
  if (std::abs(seconds_between(sights.newest, stamp)) < config_.settle_s) return false;
  came_.push_back(cell);
  return true;
}

void SpaceChanges::step(const SeenSpace& view, Timestamp stamp) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < open_.size(); ++i) {
    if (take(open_[i], view.at(open_[i]), stamp, sights_[i])) continue;
    open_[kept] = open_[i];
    sights_[kept++] = sights_[i];
  }
  open_.resize(kept);
  sights_.resize(kept);
}

std::vector<SpaceIndex> SpaceChanges::gone() const {
  return in_large_parts(gone_, config_.min_cells);
}

std::vector<SpaceIndex> SpaceChanges::came() const {
  return in_large_parts(came_, config_.min_cells);
}

}  // namespace ygslam
