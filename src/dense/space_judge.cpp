#include "dense/space_judge.hpp"

#include <algorithm>
#include <limits>

namespace ygslam {
namespace {

constexpr int kNewestViews = 12;  // that are asked about a change as it is seen

}  // namespace

bool SpaceJudge::may_be_removed(SpaceCounts known) const {
  return known.through >= config_.changes.agreeing_views && known.state() == SpaceState::kOccupied;
}

bool SpaceJudge::may_have_appeared(SpaceCounts known) const {
  return known.hits >= config_.changes.agreeing_views &&
         known.through > config_.reading.max_through_ratio * known.hits;
}

bool SpaceJudge::may_see(const ViewPlacement& view, const std::vector<SpaceIndex>& cells) const {
  const SE3 T_camera_world = view.T_world_camera.inverse();
  const double cell_m = config_.volume.space.cell_m;
  return std::any_of(cells.begin(), cells.end(), [&](const SpaceIndex& cell) {
    const Vec3 p_camera = T_camera_world * ((cell.cast<double>() + Vec3::Constant(0.5)) * cell_m);
    return p_camera.z() > 0 && p_camera.z() < config_.volume.preparation.max_depth_m &&
           camera_.contains(camera_.project(p_camera));
  });
}

bool SpaceJudge::is_change(const SeenSpace& observed, const SpaceLayer& space) const {
  const int views = config_.changes.agreeing_views;
  const auto is_surface = [&](const SpaceIndex& cell) { return space.counts(cell).hits >= views; };
  const auto stands = [&](const SpaceIndex& cell) {
    return is_surface(cell) && !may_have_appeared(space.counts(cell));
  };
  const auto is_news = [&](const SpaceIndex& cell, CellObservation seen) {
    const int through = space.counts(cell).through;
    if (seen == CellObservation::kThrough) return is_surface(cell) && through < views;
    if (through == 0) return false;
    for (int axis = 0; axis < 3; ++axis)  // noise puts a surface into the next cell
      for (const int step : {-1, 0, 1})
        if (stands(cell + step * SpaceIndex::Unit(axis))) return false;
    return true;
  };
  return !in_large_parts(cells_where(observed, is_news), config_.changes.min_cells).empty();
}

SpaceVerdict SpaceJudge::judge(FusedVolume& fused) const {
  SpaceLayer counted(config_.volume.space);  // as if nothing had been taken back
  for (const DenseViewId id : fused.ids())
    counted.count(fused.observed_space(id), {}, 1, config_.volume.threads);
  const auto is_disputed = [&](const SpaceIndex&, SpaceCounts known) {
    return known.hits > 0 && (may_be_removed(known) || may_have_appeared(known));
  };
  return judge(fused, cells_where(counted, is_disputed), std::numeric_limits<int>::max());
}

SpaceVerdict SpaceJudge::judge(FusedVolume& fused, DenseViewId view) const {
  const auto is_disputed = [&](const SpaceIndex& cell, CellObservation seen) {
    const SpaceCounts known = fused.volume().space().counts(cell);
    return seen == CellObservation::kThrough ? known.hits > 0 && may_be_removed(known)
                                             : may_have_appeared(known);
  };
  return judge(fused, cells_where(fused.observed_space(view), is_disputed), kNewestViews);
}

SpaceVerdict SpaceJudge::judge(FusedVolume& fused, const std::vector<SpaceIndex>& disputed,
                               int most_views) const {
  SpaceChanges changes(config_.changes, disputed);
  const std::vector<DenseViewId> ids = fused.ids();
  for (auto id = ids.rbegin(); id != ids.rend() && most_views > 0; ++id) {
    const ViewPlacement& view = *fused.find(*id);
    if (!may_see(view, changes.open())) continue;
    changes.step(fused.observed_space(*id), view.stamp);
    --most_views;
  }
  return verdict_of(fused, changes);
}

SpaceVerdict SpaceJudge::verdict_of(FusedVolume& fused, const SpaceChanges& changes) const {
  SpaceVerdict verdict;
  const std::vector<SpaceIndex> removed = changes.removed(), appeared = changes.appeared();
  std::vector<int> through(removed.size(), 0), hits(appeared.size(), 0);
  const std::vector<DenseViewId> ids = fused.ids();
  for (auto id = ids.rbegin(); id != ids.rend(); ++id) {
    const ViewPlacement& view = *fused.find(*id);
    if (!may_see(view, removed) && !may_see(view, appeared)) continue;
    const SeenSpace& seen = fused.observed_space(*id);
    SpaceVerdict::Cells& its = verdict.cells[*id];
    bool decides = false;
    for (std::size_t i = 0; i < removed.size(); ++i) {
      const CellObservation seen_as = seen.at(removed[i]);
      if (seen_as == CellObservation::kHit) its.removed.push_back(removed[i]);
      if (seen_as == CellObservation::kThrough && through[i]++ < config_.changes.agreeing_views)
        decides = true;
    }
    for (std::size_t i = 0; i < appeared.size(); ++i) {
      const CellObservation seen_as = seen.at(appeared[i]);
      if (seen_as == CellObservation::kThrough) its.appeared.push_back(appeared[i]);
      if (seen_as == CellObservation::kHit && hits[i]++ < config_.changes.agreeing_views)
        decides = true;
    }
    if (decides) verdict.deciding.insert(*id);
  }
  return verdict;
}

}  // namespace ygslam
