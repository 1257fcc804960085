// Where views of a dense map disagree about space.
#include <algorithm>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>

#include "dense/dense_map.hpp"
#include "dense/pose_distance.hpp"

namespace ygslam {
namespace {

constexpr int kSettledOver = 12;  // newest views that are asked about a change as it is seen

void add_gone(const std::vector<SpaceIndex>& cells, double cell_m, PixelState& state) {
  std::vector<CellKey> keys = state.gone ? *state.gone : std::vector<CellKey>();
  for (const SpaceIndex& cell : cells)
    keys.push_back(cell_key((cell.cast<double>() + Vec3::Constant(0.5)) * cell_m, cell_m));
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  state.gone = std::make_shared<const std::vector<CellKey>>(std::move(keys));
}

void add_came(const std::vector<SpaceIndex>& cells, PixelState& state) {
  std::vector<SpaceIndex> all = state.came ? *state.came : std::vector<SpaceIndex>();
  all.insert(all.end(), cells.begin(), cells.end());
  const auto order = [](const SpaceIndex& c) { return std::tuple(c.z(), c.y(), c.x()); };
  std::sort(all.begin(), all.end(),
            [&](const SpaceIndex& a, const SpaceIndex& b) { return order(a) < order(b); });
  all.erase(std::unique(all.begin(), all.end()), all.end());
  state.came = std::make_shared<const std::vector<SpaceIndex>>(std::move(all));
}

}  // namespace

bool DenseMap::Contribution::Seen::is_of(const SE3& T_world_now,
                                         const PixelState& state_now) const {
  return same(T_world_camera, T_world_now) && state == state_now;
}

const SeenSpace& DenseMap::space_seen(Contribution& contribution) {
  PixelState state = seen_state(contribution.fused ? contribution.fused_state : PixelState{});
  state.ids.resize(contribution.things.size(), kNoSceneObject);
  const SE3& T_world_camera = contribution.fused ? *contribution.fused : *contribution.wanted;
  std::optional<Contribution::Seen>& seen = contribution.seen;
  if (!seen || !seen->is_of(T_world_camera, state))
    seen = {volume_.look(view_of(contribution, state, T_world_camera), T_world_camera),
            T_world_camera, state};
  return seen->space;
}

void DenseMap::spare_anew(Contribution& now) {
  if (!now.fused || !now.wanted_state) return;
  PixelState spared = now.fused_state;
  spared.came = now.wanted_state->came;
  if (spared == now.fused_state || spared != *now.wanted_state) return;
  const auto cells = [](const PixelState& state) {
    return state.came ? *state.came : std::vector<SpaceIndex>();
  };
  const SeenSpace& seen = now.seen_without_gone ? *now.seen_without_gone : space_seen(now);
  volume_.spare_anew(seen, cells(now.fused_state), cells(spared));
  now.fused_state = spared;
}

bool DenseMap::sees_space_change(Contribution& contribution) {
  const int looks = config_.changes.looks;
  const SpaceLayer& space = volume_.space();
  const auto is_surface = [&](const SpaceIndex& cell) { return space.counts(cell).hits >= looks; };
  const auto stands = [&](const SpaceIndex& cell) {
    return is_surface(cell) && !may_have_come(space.counts(cell));
  };
  const auto is_news = [&](const SpaceIndex& cell, SpaceSight seen) {
    const int through = space.counts(cell).through;
    if (seen == SpaceSight::kThrough) return is_surface(cell) && through < looks;
    if (through == 0) return false;
    for (int axis = 0; axis < 3; ++axis)  // noise puts a surface into the next cell
      for (const int step : {-1, 0, 1})
        if (stands(cell + step * SpaceIndex::Unit(axis))) return false;
    return true;
  };
  return !in_large_parts(cells_where(space_seen(contribution), is_news), config_.changes.min_cells)
              .empty();
}

bool DenseMap::may_see(const Contribution& contribution,
                       const std::vector<SpaceIndex>& cells) const {
  const SE3 T_camera_world = contribution.fused->inverse();
  const double cell_m = config_.volume.space.cell_m;
  return std::any_of(cells.begin(), cells.end(), [&](const SpaceIndex& cell) {
    const Vec3 p_camera = T_camera_world * ((cell.cast<double>() + Vec3::Constant(0.5)) * cell_m);
    return p_camera.z() > 0 && p_camera.z() < config_.volume.preparation.max_depth_m &&
           camera_.contains(camera_.project(p_camera));
  });
}

void DenseMap::settle_space(const std::vector<SpaceIndex>& disputed, int most_views) {
  SpaceChanges changes(config_.changes, disputed);
  for (auto at = contributions_.rbegin(); at != contributions_.rend() && most_views > 0; ++at) {
    Contribution& contribution = at->second;
    if (!contribution.fused || !may_see(contribution, changes.open())) continue;
    changes.step(space_seen(contribution), contribution.stamp);
    --most_views;
  }
  const std::vector<SpaceIndex> gone = changes.gone(), came = changes.came();
  std::vector<int> through(gone.size(), 0), hits(came.size(), 0);
  for (auto at = contributions_.rbegin(); at != contributions_.rend(); ++at) {
    Contribution& contribution = at->second;
    if (!contribution.fused || !contribution.wanted_state ||
        !(may_see(contribution, gone) || may_see(contribution, came)))
      continue;
    const SeenSpace& seen = space_seen(contribution);
    std::vector<SpaceIndex> its_gone, its_came;
    for (std::size_t i = 0; i < gone.size(); ++i) {
      const SpaceSight sight = seen.at(gone[i]);
      if (sight == SpaceSight::kHit) its_gone.push_back(gone[i]);
      if (sight == SpaceSight::kThrough && through[i]++ < config_.changes.looks)
        contribution.decides_change = true;
    }
    for (std::size_t i = 0; i < came.size(); ++i) {
      const SpaceSight sight = seen.at(came[i]);
      if (sight == SpaceSight::kThrough) its_came.push_back(came[i]);
      if (sight == SpaceSight::kHit && hits[i]++ < config_.changes.looks)
        contribution.decides_change = true;
    }
    PixelState& state = *contribution.wanted_state;
    if (!its_gone.empty()) add_gone(its_gone, config_.objects.cell_m, state);
    if (!its_came.empty()) add_came(its_came, state);
  }
}

bool DenseMap::may_be_gone(SpaceCounts known) const {
  return known.through >= config_.changes.looks && known.state() == SpaceState::kOccupied;
}

bool DenseMap::may_have_come(SpaceCounts known) const {
  return known.hits >= config_.changes.looks &&
         known.through > config_.reading.max_through_ratio * known.hits;
}

void DenseMap::settle_space() {
  SpaceLayer counted(config_.volume.space);  // as if nothing had been taken back
  for (auto& [id, contribution] : contributions_) {
    if (contribution.wanted_state)
      contribution.wanted_state = without_changes(*contribution.wanted_state);
    contribution.decides_change = false;
    if (contribution.fused) counted.count(space_seen(contribution), {}, 1, config_.volume.threads);
  }
  settle_space(cells_where(counted,
                           [&](const SpaceIndex&, SpaceCounts known) {
                             return known.hits > 0 && (may_be_gone(known) || may_have_come(known));
                           }),
               std::numeric_limits<int>::max());
  is_space_settled_ = true;
}

void DenseMap::settle_space_of(Contribution& contribution) {
  settle_space(cells_where(space_seen(contribution),
                           [&](const SpaceIndex& cell, SpaceSight seen) {
                             const SpaceCounts known = volume_.space().counts(cell);
                             return seen == SpaceSight::kThrough
                                        ? known.hits > 0 && may_be_gone(known)
                                        : may_have_come(known);
                           }),
               kSettledOver);
}

}  // namespace ygslam
