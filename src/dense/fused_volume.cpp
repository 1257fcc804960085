#include "dense/fused_volume.hpp"

#include <algorithm>
#include <utility>

#include "core/check.hpp"
#include "core/trace.hpp"
#include "dense/pose_distance.hpp"

namespace ygslam {
namespace {

std::vector<SpaceIndex> appeared_cells(const PixelState& state) {
  return state.appeared ? *state.appeared : std::vector<SpaceIndex>();
}

/// But for the cells that must not be carved, which are exchanged without the view's pixels.
bool shows_the_same(const PixelState& a, PixelState b) {
  b.appeared = a.appeared;
  return a == b;
}

}  // namespace

FusedVolume::FusedVolume(const DenseMapConfig& config, std::shared_ptr<ViewUnpacker> unpacker)
    : config_(config),
      unpacker_(std::move(unpacker)),
      volume_(config.volume),
      mesher_(config.reading),
      min_views_(config.reading.min_views) {}

bool FusedVolume::ObservedSpace::is_of(const SE3& T_world_now, const PixelState& state_now) const {
  return same(T_world_camera, T_world_now) && state == state_now;
}

DepthView FusedVolume::pixels_of(const ViewPlacement& placement) {
  DepthView view = unpacker_->unpacked(placement.images);
  apply_state(placement.state, placement.T_world_camera, config_.margin_px, config_.objects.cell_m,
              view);
  return view;
}

const SeenSpace& FusedVolume::observe(const ViewPlacement& view) {
  return volume_.observe(pixels_of(view), view.T_world_camera);
}

const SeenSpace& FusedVolume::observed_space(View& view) {
  ViewPlacement bare = view.placement;
  bare.state = space_state(bare.state);
  if (!view.observed || !view.observed->is_of(bare.T_world_camera, bare.state))
    view.observed = {observe(bare), bare.T_world_camera, bare.state};
  return view.observed->space;
}

const SeenSpace& FusedVolume::observed_space(DenseViewId id) {
  return observed_space(views_.at(id));
}

SeenSpace FusedVolume::take_counted_space(View& view) {
  if (!view.counted) return observed_space(view);
  SeenSpace counted = std::move(*view.counted);
  view.counted.reset();
  return counted;
}

void FusedVolume::put_in(DenseViewId id, const ViewPlacement& wanted,
                         std::optional<ObservedSpace> known) {
  const trace::Span span("fuse");
  if (is_full()) return;
  const SeenSpace& seen = volume_.integrate(pixels_of(wanted), wanted.T_world_camera);
  View& view = views_[id];
  view = {wanted, std::move(known), std::nullopt};
  if (wanted.state.removed)
    view.counted = seen;
  else
    view.observed = {seen, wanted.T_world_camera, space_state(wanted.state)};
}

std::optional<FusedVolume::ObservedSpace> FusedVolume::take_back(Views::iterator view) {
  const trace::Span span("take back");
  const ViewPlacement& placement = view->second.placement;
  const SeenSpace counted = take_counted_space(view->second);
  volume_.deintegrate(pixels_of(placement), placement.T_world_camera, counted);
  std::optional<ObservedSpace> observed = std::move(view->second.observed);
  views_.erase(view);
  return observed;
}

void FusedVolume::remove(DenseViewId id) {
  if (const auto view = views_.find(id); view != views_.end()) take_back(view);
}

void FusedVolume::exchange_appeared(View& view, const PixelState& wanted) {
  PixelState& state = view.placement.state;
  if (state == wanted || !shows_the_same(state, wanted)) return;
  const SeenSpace& seen = view.counted ? *view.counted : observed_space(view);
  volume_.exchange_spared(seen, appeared_cells(state), appeared_cells(wanted));
  state.appeared = wanted.appeared;
}

void FusedVolume::exchange_pixels(View& view, const ViewPlacement& wanted) {
  const trace::Span span("exchange pixels");
  ViewPlacement& now = view.placement;
  const DepthView before = pixels_of(now);
  const SeenSpace counted = take_counted_space(view);
  now.state = wanted.state;
  now.stamp = wanted.stamp;
  const SeenSpace& seen = volume_.exchange(before, counted, pixels_of(now), now.T_world_camera);
  if (now.state.removed)
    view.counted = seen;
  else
    view.observed = {seen, now.T_world_camera, space_state(now.state)};
}

void FusedVolume::sync(DenseViewId id, const ViewPlacement& wanted, double tolerance_m) {
  const auto view = views_.find(id);
  if (view == views_.end()) {
    put_in(id, wanted, std::nullopt);
    return;
  }
  exchange_appeared(view->second, wanted.state);
  const ViewPlacement& now = view->second.placement;
  const bool is_there =
      same(now.T_world_camera, wanted.T_world_camera) ||
      (tolerance_m > 0 && distance_m(now.T_world_camera, wanted.T_world_camera) <= tolerance_m);
  if (is_there && now.state == wanted.state) return;
  if (is_there && now.images == wanted.images) {
    exchange_pixels(view->second, wanted);
    return;
  }
  std::optional<ObservedSpace> known = take_back(view);
  put_in(id, wanted, std::move(known));
}

void FusedVolume::sync(const Placements& wanted) {
  // In views put in: taking one back costs as much, exchanging pixels not more.
  const auto cost_of = [&](const auto& entry) {
    const auto its = wanted.find(entry.first);
    const ViewPlacement& now = entry.second.placement;
    const bool is_there = its != wanted.end() && now.images == its->second.images &&
                          same(now.T_world_camera, its->second.T_world_camera);
    return !is_there ? 2 : shows_the_same(now.state, its->second.state) ? 0 : 1;
  };
  std::ptrdiff_t cost = 0;
  for (const auto& entry : views_) cost += cost_of(entry);
  if (cost > std::ssize(wanted)) {
    Views before = start_again();
    for (const auto& [id, placement] : wanted)
      put_in(id, placement, std::move(before[id].observed));
    return;
  }
  for (const DenseViewId id : ids())
    if (!wanted.contains(id)) remove(id);
  for (const auto& [id, placement] : wanted) sync(id, placement);
}

FusedVolume::Views FusedVolume::start_again() {
  volume_.clear();
  mesher_ = Mesher(config_.reading);
  min_views_ = config_.reading.min_views;
  return std::exchange(views_, {});
}

bool FusedVolume::add(DepthView view, const SE3& T_world_camera) {
  CHECK(view.objects.empty());
  if (is_full()) return false;
  const auto stored = std::make_shared<const StoredView>(view);  // gives it its coarse colours
  volume_.integrate(view, T_world_camera);
  const bool is_first = views_.empty() || views_.rbegin()->first.keyframe != kNoKeyframe;
  const DenseViewId id(kNoKeyframe, is_first ? 0 : views_.rbegin()->first.number + 1);
  views_.emplace(id, View{{stored, {}, T_world_camera, {}}, {}, {}});
  return true;
}

const ViewPlacement* FusedVolume::find(DenseViewId id) const {
  const auto view = views_.find(id);
  return view == views_.end() ? nullptr : &view->second.placement;
}

std::vector<DenseViewId> FusedVolume::ids() const {
  std::vector<DenseViewId> ids;
  ids.reserve(views_.size());
  for (const auto& [id, view] : views_) ids.push_back(id);
  return ids;
}

TriangleMesh FusedVolume::mesh() {
  const trace::Span span("mesh");
  // A scene that fewer views saw than a surface needs is shown all the same.
  const int min_views = std::clamp(volume_.views(), 1, config_.reading.min_views);
  if (std::exchange(min_views_, min_views) != min_views) {
    ReadingConfig reading = config_.reading;
    reading.min_views = min_views;
    mesher_ = Mesher(reading);
  }
  mesher_.update(volume_);
  return mesher_.mesh(volume_);
}

std::size_t FusedVolume::memory_bytes() const {
  std::size_t bytes = volume_.memory_bytes() + mesher_.memory_bytes();
  for (const auto& [id, view] : views_) {
    if (view.observed) bytes += view.observed->space.memory_bytes();
    if (view.counted) bytes += view.counted->memory_bytes();
  }
  return bytes;
}

}  // namespace ygslam
