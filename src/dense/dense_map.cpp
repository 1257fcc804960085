#include "dense/dense_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "dense/mask_depth.hpp"
#include "dense/pose_distance.hpp"
#include "dense/round_things.hpp"
#include "volume/reading.hpp"

namespace ygslam {
namespace {

constexpr double kLooseVoxels = 0.5;
constexpr int kSampleStep_px = 12;

SurfaceSample sample_of(const DepthView& view, const VolumeConfig& config) {
  return {view, config.preparation, kSampleStep_px};
}

}  // namespace

std::vector<ColouredPoint> coloured_points(const TriangleMesh& mesh) {
  std::vector<ColouredPoint> points;
  points.reserve(mesh.vertices.size());
  for (const SurfacePoint& vertex : mesh.vertices)
    points.push_back({vertex.p_world, vertex.colour});
  return points;
}

DenseMap::DenseMap(const DenseMapConfig& config, const Camera& camera)
    : config_(config), camera_(camera), objects_(config.objects), volume_(config.volume) {
  CHECK(config.objects.cell_m == config.volume.space.cell_m);
  start_again();
}

void DenseMap::start_again() {
  volume_.clear();
  mesher_.emplace(config_.reading);
  min_views_ = config_.reading.min_views;
  for (auto& [id, contribution] : contributions_) contribution.fused.reset();
}

void DenseMap::apply(const DenseUpdate& update) {
  if (!config_.enabled) return;
  if (!update.added.empty() || !update.removed.empty()) is_finished_ = false;
  for (const DenseFrame& keyframe : update.added) {
    GreyImage excluded = dilated(keyframe.movers, config_.margin_px);
    CHECK(keyframe.detections.size() <= kMaxDetections);
    const auto moving = moving_things(keyframe.things, keyframe.movers, keyframe.detections.size(),
                                      keyframe.motion_votes);
    for (std::size_t i = 0; i < excluded.size() && !keyframe.things.empty(); ++i) {
      const std::uint8_t number = keyframe.things.begin()[i];  // where it moves is known first
      if (number > 0 && moving[number - 1U]) excluded.begin()[i] = 0;
    }
    const GreyImage inner = without_edges(keyframe.things, keyframe.edge_px);
    Image<SceneObjectId> numbers(inner.width(), inner.height());
    std::transform(keyframe.things.begin(), keyframe.things.end(), inner.begin(), numbers.begin(),
                   [](std::uint8_t number, std::uint8_t kept) {
                     return number != kept ? kUnsureObject : SceneObjectId{kept};
                   });
    DepthView view =
        make_depth_view({keyframe.frame->depth_m, keyframe.frame->colour, numbers, excluded},
                        camera_, keyframe.read_out);
    drop_what_lies_elsewhere(view, config_.volume.preparation);
    drop_beyond_round_things(view, keyframe.detections, config_.volume.preparation.noise);
    auto things = thing_views(view, keyframe.detections, config_.volume.preparation.max_depth_m);
    std::vector<bool> is_gone;
    for (const SceneObjectId number : view.objects) {
      const std::size_t i = static_cast<std::size_t>(number) - 1;
      is_gone.push_back(moving[i]);
      things[i].is_moving = moving[i];
    }
    exclude_objects(view, is_gone, config_.margin_px);
    Contribution contribution;
    contribution.view = std::make_shared<const StoredView>(view);
    restored_ = {contribution.view, std::move(view)};
    contribution.things = std::move(things);
    contribution.stamp = keyframe.frame->stamp;
    contribution.anchor = keyframe.anchor;
    contributions_.emplace(keyframe.anchor ? next_id(keyframe.id.keyframe) : keyframe.id,
                           std::move(contribution));
  }
  for (const RemovedAnchor& removed : update.removed) {
    if (const auto gone = contributions_.find(removed.id); gone != contributions_.end()) {
      if (removed.now.keyframe == kNoKeyframe) {
        remove(gone);
        continue;
      }
      // The map has enough landmarks there; whether the surface was seen enough is another
      // question.
      gone->second.anchor = {removed.id, gone->second.stamp, SE3()};
      gone->second.sample = sample_of(restored(gone->second), config_.volume);
    }
    for (auto& [id, contribution] : contributions_) {
      if (!contribution.anchor || contribution.anchor->keyframe != removed.id) continue;
      const SE3 T_camera_removed = contribution.anchor->T_camera_keyframe;
      contribution.anchor = removed.now;
      contribution.anchor->T_camera_keyframe = T_camera_removed * removed.now.T_camera_keyframe;
    }
  }
  for (auto& [id, contribution] : contributions_) {
    const auto& anchor = contribution.anchor;
    const auto pose = update.T_world_camera.find(anchor ? anchor->keyframe : id.keyframe);
    const std::optional<SE3> before = std::exchange(contribution.wanted, std::nullopt);
    if (pose != update.T_world_camera.end())
      contribution.wanted =
          anchor ? pose->second * anchor->T_camera_keyframe.inverse() : pose->second;
    if (!same(before, contribution.wanted)) is_finished_ = false;
  }
}

DenseViewId DenseMap::next_id(KeyframeId newest) const {
  auto after = contributions_.upper_bound({newest, std::numeric_limits<std::uint32_t>::max()});
  if (after == contributions_.begin()) return {newest, 1};
  const DenseViewId last = (--after)->first;
  return {newest, last.keyframe == newest ? last.number + 1 : 1};
}

void DenseMap::restore(const std::vector<SavedView>& views) {
  if (!config_.enabled) return;
  is_finished_ = false;
  for (const SavedView& saved : views) {
    Contribution contribution;
    contribution.view = saved.view;
    contribution.things = saved.things;
    contribution.stamp = saved.stamp;
    contribution.anchor = saved.anchor;
    if (saved.anchor) contribution.sample = sample_of(saved.view->restored(), config_.volume);
    contributions_.emplace(saved.id, std::move(contribution));
  }
}

std::vector<SavedView> DenseMap::saved() const {
  std::vector<SavedView> views;
  for (const auto& [id, contribution] : contributions_) {
    if (!contribution.wanted) continue;
    views.push_back(
        {id, contribution.stamp, contribution.things, contribution.view, contribution.anchor});
  }
  return views;
}

bool DenseMap::Contribution::is_up_to_date() const {
  return same(wanted, fused) && (!fused || wanted_state == fused_state);
}

const DepthView& DenseMap::restored(const Contribution& contribution) {
  if (restored_.packed != contribution.view)
    restored_ = {contribution.view, contribution.view->restored()};
  return restored_.view;
}

DepthView DenseMap::view_of(const Contribution& contribution, const PixelState& state,
                            const SE3& T_world_camera) {
  DepthView view = restored(contribution);
  apply_state(state, T_world_camera, config_.margin_px, config_.objects.cell_m, view);
  return view;
}

void DenseMap::take_back(Contribution& old) {
  if (old.fused) volume_.withdraw(view_of(old, old.fused_state, *old.fused), *old.fused);
  old.fused.reset();
}

double DenseMap::out_of_place_m(const Contribution& contribution) const {
  const auto& wanted = contribution.wanted;
  const auto& fused = contribution.fused;
  if (!wanted && !fused) return 0;
  if (!wanted || !fused || contribution.wanted_state != contribution.fused_state)
    return std::numeric_limits<double>::infinity();
  return distance_m(*fused, *wanted);
}

bool DenseMap::association_is_loose() const {
  return std::any_of(contributions_.begin(), contributions_.end(), [&](const auto& entry) {
    const Contribution& c = entry.second;
    const bool depends_on_pose =
        !c.things.empty() || (c.wanted_state && (c.wanted_state->gone || c.wanted_state->came));
    return c.wanted && c.associated && depends_on_pose &&
           distance_m(*c.associated, *c.wanted) > config_.objects.cell_m;
  });
}

void DenseMap::bring_up_to_date(Contribution& now) {
  spare_anew(now);
  if (now.is_up_to_date()) return;
  take_back(now);
  if (!now.wanted || volume_.views() + 1 >= Volume::kMaxViews) return;
  if (!now.wanted_state) associate(now);
  const SeenSpace& seen =
      volume_.integrate(view_of(now, *now.wanted_state, *now.wanted), *now.wanted);
  now.fused = now.wanted;
  now.fused_state = *now.wanted_state;
  now.seen_without_gone.reset();
  if (now.fused_state.gone)
    now.seen_without_gone = seen;
  else
    now.seen = {seen, *now.fused, seen_state(now.fused_state)};
}

void DenseMap::associate(Contribution& now) {
  now.associated = now.wanted;
  std::vector<SceneObjectId> gone;
  if (!objects_.objects().empty()) gone = objects_.look(restored(now), *now.wanted, now.stamp);
  now.wanted_state = PixelState{objects_.step(now.things, *now.wanted, now.stamp), {}, {}, {}};
  if (now.fused) {  // what came or went stays until space is settled anew
    now.wanted_state->gone = now.fused_state.gone;
    now.wanted_state->came = now.fused_state.came;
  }
  for (const SceneObjectId id : gone) withdraw(id);
}

void DenseMap::withdraw(SceneObjectId gone) {
  const KnownObject& object = objects_.objects().at(gone);
  const auto place = std::make_shared<const std::vector<CellKey>>(object.place());
  for (auto& [id, contribution] : contributions_) {
    if (!contribution.wanted_state || !object.shown.contains(contribution.stamp)) continue;
    contribution.wanted_state->emptied.push_back(place);
    for (SceneObjectId& its : contribution.wanted_state->ids)
      if (objects_.current(its) == gone) its = kWithdrawnObject;
  }
}

void DenseMap::associate_all() {
  objects_ = ObjectMap(config_.objects);
  is_space_settled_ = false;
  for (auto& [id, contribution] : contributions_) contribution.wanted_state.reset();
  for (auto& [id, contribution] : contributions_)
    if (contribution.wanted) associate(contribution);
  for (auto& [id, contribution] : contributions_) {
    if (!contribution.wanted_state) continue;
    for (SceneObjectId& object : contribution.wanted_state->ids) object = objects_.current(object);
  }
}

bool DenseMap::shows_new(Contribution& now, const SurfaceSample& sample) {
  const int needed = config_.reading.min_views;
  return sample.share_seen_less(needed, *now.wanted, volume_.surface()) >= config_.min_new ||
         objects_.knows_too_little(now.things, *now.wanted, config_.thing_views) ||
         objects_.sees_change(restored(now), *now.wanted) || sees_space_change(now);
}

bool DenseMap::drop_needless(DenseViewId id) {
  Contribution& now = contributions_.at(id);
  if (!now.anchor || now.sample || !now.wanted) return false;
  const SurfaceSample sample = sample_of(restored(now), config_.volume);
  if (!shows_new(now, sample)) {
    contributions_.erase(id);
    return true;
  }
  now.sample = sample;
  return false;
}

bool DenseMap::step() {
  DenseViewId farthest_id;
  Contribution* farthest = nullptr;
  const double loose_m = kLooseVoxels * config_.volume.surface.voxel_m;
  double farthest_m = loose_m;
  for (auto& [id, contribution] : contributions_) {
    const double off_m = out_of_place_m(contribution);
    if (off_m <= farthest_m) continue;
    farthest_id = id;
    farthest = &contribution;
    farthest_m = off_m;
  }
  if (!farthest) {
    if (!is_space_settled_) {
      settle_space();
      return true;
    }
    if (!association_is_loose()) return false;
    associate_all();
    return true;
  }
  if (drop_needless(farthest_id)) return true;
  const bool is_new = !farthest->fused;
  spare_anew(*farthest);
  if (out_of_place_m(*farthest) > loose_m) bring_up_to_date(*farthest);
  const bool is_done = out_of_place_m(*farthest) <= loose_m;
  if (is_new && is_done) {
    const SE3 T_world_camera = *farthest->fused;
    settle_space_of(*farthest);
    cull();
    thin_out(T_world_camera);
  }
  return is_done;
}

void DenseMap::take_in_new_frames() {
  const auto is_new_frame = [](const Contribution& c) { return c.anchor && !c.sample && c.wanted; };
  if (std::none_of(contributions_.begin(), contributions_.end(),
                   [&](const auto& c) { return is_new_frame(c.second); }))
    return;
  for (auto at = contributions_.begin(); at != contributions_.end();) {
    const auto now = at++;
    // Whether it shows something new depends on what those before it showed.
    if (!now->second.fused && !drop_needless(now->first)) bring_up_to_date(now->second);
  }
}

void DenseMap::finish() {
  if (is_finished_) return;
  take_in_new_frames();
  associate_all();
  settle_space();  // what came or went is all but known, so that few are put in twice
  const auto moved = std::count_if(contributions_.begin(), contributions_.end(), [](const auto& c) {
    return c.second.fused && !c.second.is_up_to_date();
  });
  // Putting all in anew costs half as much as taking each back first.
  if (2 * moved > std::ssize(contributions_)) start_again();
  for (auto& [id, contribution] : contributions_) bring_up_to_date(contribution);
  settle_space();
  for (auto& [id, contribution] : contributions_) bring_up_to_date(contribution);
  is_finished_ = true;
}

bool DenseMap::add(const DepthView& view, const SE3& T_world_camera) {
  if (volume_.views() + 1 >= Volume::kMaxViews) return false;
  DepthView kept = view;
  added_.emplace_back(T_world_camera, StoredView(kept));
  volume_.integrate(kept, T_world_camera);
  return true;
}

TriangleMesh DenseMap::mesh() {
  // A scene that fewer keyframes saw than a surface needs is shown all the same.
  const int min_views = std::clamp(volume_.views(), 1, config_.reading.min_views);
  if (std::exchange(min_views_, min_views) != min_views) {
    ReadingConfig reading = config_.reading;
    reading.min_views = min_views;
    mesher_.emplace(reading);
  }
  mesher_->update(volume_);
  return mesher_->mesh(volume_);
}

std::vector<DenseMap::PlacedView> DenseMap::views() const {
  std::vector<PlacedView> views;
  for (const auto& [id, contribution] : contributions_)
    if (contribution.fused)
      views.push_back({id, contribution.stamp, *contribution.fused, contribution.view.get()});
  for (const auto& [T_world_camera, view] : added_)
    views.push_back({{}, {}, T_world_camera, &view});
  return views;
}

DepthView DenseMap::images(const PlacedView& view) {
  const auto known = contributions_.find(view.id);
  return known == contributions_.end()
             ? view.view->restored()
             : view_of(known->second, known->second.fused_state, view.T_world_camera);
}

std::size_t DenseMap::memory_bytes() const {
  std::size_t bytes = volume_.memory_bytes() + mesher_->memory_bytes();
  for (const auto& [id, contribution] : contributions_) {
    bytes += contribution.view->bytes();
    if (contribution.sample) bytes += contribution.sample->bytes();
    if (contribution.seen) bytes += contribution.seen->space.memory_bytes();
    if (contribution.seen_without_gone) bytes += contribution.seen_without_gone->memory_bytes();
    for (const ThingView& thing : contribution.things)
      bytes += thing.p_camera.capacity() * sizeof(Eigen::Vector3f);
  }
  return bytes;
}

}  // namespace ygslam
