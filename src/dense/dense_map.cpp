#include "dense/dense_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/check.hpp"
#include "core/trace.hpp"
#include "dense/pose_distance.hpp"
#include "dense/view_intake.hpp"

namespace ygslam {
namespace {

constexpr double kLooseVoxels = 0.5;
// A view's changes in this time are made at once: what each new view removes from it while people
// walk, and where nobody looks also what appears and small corrections of its pose.
constexpr double kGather_s = 10, kGatherWatched_s = 1;

GroundPlanConfig plan_config(const DenseMapConfig& config) {
  GroundPlanConfig plan = config.plan;
  plan.min_views = config.reading.min_views;
  return plan;
}

double loose_m(const DenseMapConfig& config) {
  return kLooseVoxels * config.volume.surface.voxel_m;
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
    : config_(config),
      camera_(camera),
      fused_(config, unpacker_),
      judge_(config, camera, unpacker_),
      policy_(config, unpacker_),
      plan_(plan_config(config)),
      is_watched_(config.keeps_plan) {
  CHECK(config.objects.cell_m == config.volume.space.cell_m);
}

void DenseMap::expect_looks() { is_watched_ = true; }

void DenseMap::apply(const DenseUpdate& update) {
  if (!config_.enabled) return;
  if (!update.added.empty() || !update.removed.empty()) is_finished_ = false;
  for (const DenseFrame& frame : update.added) add(frame);
  for (const RemovedAnchor& removed : update.removed) drop_keyframe(removed);
  if (views_.set_poses(update.T_world_camera)) is_finished_ = false;
}

void DenseMap::add(const DenseFrame& frame) {
  const trace::Span span("view intake", frame.frame->id);
  IncomingView incoming = incoming_view(frame, config_, camera_);
  newest_ = frame.frame->stamp;
  auto stored = std::make_shared<const StoredView>(incoming.images);
  unpacker_->keep(stored, std::move(incoming.images));
  views_.add(
      frame.id.keyframe,
      {std::move(stored), std::move(incoming.observations), frame.frame->stamp, frame.anchor, {}});
}

void DenseMap::drop_keyframe(const RemovedAnchor& removed) {
  if (views_.contains(removed.id)) {
    if (removed.now.keyframe == kNoKeyframe) {
      remove(removed.id);
      return;
    }
    // The map has enough landmarks there; whether the surface was seen enough is another question.
    if (fused_.is_full() && !fused_.contains(removed.id))
      remove(removed.id);  // it would wait for ever
    else
      policy_.enter(removed.id, views_.at(removed.id).images);
  }
  views_.reanchor(removed);
}

void DenseMap::restore(const std::vector<SavedView>& views) {
  if (!config_.enabled) return;
  is_finished_ = false;
  for (const SavedView& saved : views) {
    views_.restore(saved);
    if (saved.anchor) policy_.enter(saved.id, saved.view);
  }
}

double DenseMap::out_of_place_m(DenseViewId id, const DenseView& view) const {
  const ViewPlacement* fused = fused_.find(id);
  const PixelState* state = judge_.state(id);
  if (!view.T_world_camera && fused == nullptr) return 0;
  if (fused == nullptr && fused_.is_full() && !policy_.is_undecided(id, view))
    return 0;  // it waits
  if (!view.T_world_camera || fused == nullptr || state == nullptr)
    return std::numeric_limits<double>::infinity();
  const double off_m = distance_m(fused->T_world_camera, *view.T_world_camera);
  if (was_synced_lately(id)) {
    // Corrections beyond a cell are judged anew (PixelJudge::judge_corrected).
    if (!is_watched_ && off_m <= config_.objects.cell_m &&
        is_same_but_for_changes(*state, fused->state))
      return 0;
    if (is_same_but_for_removed(*state, fused->state)) return off_m;
  }
  return *state == fused->state ? off_m : std::numeric_limits<double>::infinity();
}

bool DenseMap::was_synced_lately(DenseViewId id) const {
  const auto synced = synced_at_.find(id);
  return synced != synced_at_.end() && std::abs(seconds_between(newest_, synced->second)) <
                                           (is_watched_ ? kGatherWatched_s : kGather_s);
}

std::optional<DenseViewId> DenseMap::most_out_of_place() const {
  std::optional<DenseViewId> most;
  double most_m = loose_m(config_);
  for (const auto& [id, view] : views_.all()) {
    const double off_m = out_of_place_m(id, view);
    if (off_m <= most_m) continue;
    most = id;
    most_m = off_m;
  }
  return most;
}

bool DenseMap::step() {
  const std::optional<DenseViewId> next = most_out_of_place();
  if (!next) return make_room() || judge_corrected();
  if (drop_needless(*next)) return true;
  const ViewPlacement* before = fused_.find(*next);
  const bool is_new = before == nullptr;
  const std::optional<SE3> T_world_before =
      is_new ? std::nullopt : std::optional(before->T_world_camera);
  bring_up_to_date(*next, loose_m(config_));
  if (config_.keeps_plan) {
    note_in_plan(*next, T_world_before);
    update_plan();
  }
  if (is_new) {
    judge_.judge_space(*next, fused_);
    cull(fused_.find(*next)->T_world_camera);
  }
  return true;
}

/// Once for each keyframe that cannot enter: what it shows is told as far as it can be without it,
/// and frames may go as if it had entered.
bool DenseMap::make_room() {
  if (!fused_.is_full()) {
    refused_.clear();
    return false;
  }
  for (const auto& [id, view] : views_.all()) {
    if (!view.T_world_camera || fused_.contains(id) || !refused_.insert(id).second) continue;
    judge_.judge_objects(id, views_, fused_);
    if (config_.keeps_plan) note_in_plan(view);
    cull(*view.T_world_camera);
    return true;
  }
  return false;
}

bool DenseMap::judge_corrected() {
  if (!judge_.judge_corrected(views_, fused_)) return false;
  if (!judge_.is_judging())
    synced_at_.clear();  // what was judged anew is not one of many small changes
  return true;
}

bool DenseMap::drop_needless(DenseViewId id) {
  const trace::Span span("decide on view");
  const DenseView& view = views_.at(id);
  if (!view.T_world_camera || !policy_.is_undecided(id, view)) return false;
  if (!fused_.is_full() && policy_.enters(id, view, judge_, fused_)) return false;
  if (config_.keeps_plan) note_in_plan(view);
  views_.remove(id);
  return true;
}

void DenseMap::bring_up_to_date(DenseViewId id, double tolerance_m) {
  const DenseView& view = views_.at(id);
  if (!view.T_world_camera) {
    fused_.remove(id);
    return;
  }
  if (judge_.state(id) == nullptr) {
    if (fused_.is_full()) return;
    judge_.judge_objects(id, views_, fused_);
  }
  fused_.sync(id, {view.images, view.stamp, *view.T_world_camera, *judge_.state(id)}, tolerance_m);
  synced_at_[id] = newest_;
}

void DenseMap::note_in_plan(const DenseView& dropped) {
  PixelState state;
  state.ids.assign(dropped.observations.size(), kNoSceneObject);
  plan_.observe(
      fused_.observe({dropped.images, dropped.stamp, *dropped.T_world_camera, std::move(state)}));
  planned_ = std::max(planned_, dropped.stamp);
  update_plan();
}

void DenseMap::note_in_plan(DenseViewId id, const std::optional<SE3>& T_world_before) {
  const ViewPlacement* now = fused_.find(id);
  if (now == nullptr) return;
  ++placements_;
  if (!T_world_before)
    plan_.observe(fused_.observed_space(id));
  else if (distance_m(*T_world_before, now->T_world_camera) > loose_m(config_))
    plan_.reobserve(fused_.observed_space(id), observed_after(now->stamp));
  planned_ = std::max(planned_, views_.at(id).stamp);
}

std::vector<const SeenSpace*> DenseMap::observed_after(Timestamp stamp) {
  std::vector<std::pair<Timestamp, DenseViewId>> later;
  for (const DenseViewId id : fused_.ids())
    if (const Timestamp its = fused_.find(id)->stamp; its > stamp) later.emplace_back(its, id);
  std::sort(later.rbegin(), later.rend());
  std::vector<const SeenSpace*> seen;
  seen.reserve(later.size());
  for (const auto& [its, id] : later) seen.push_back(&fused_.observed_space(id));
  return seen;
}

bool DenseMap::wants_floor() const {
  constexpr double kMore = 1.5;
  constexpr int kMostWithout = 30;  // a floor that has come into view is soon found
  const int since = placements_ - looked_for_floor_;
  return since > 0 && (placements_ >= kMore * looked_for_floor_ ||
                       (!plan_.has_floor() && since >= kMostWithout));
}

void DenseMap::set_floor(const Gravity& gravity) {
  looked_for_floor_ = placements_;
  if (gravity.has_floor) plan_.set_floor(gravity);
}

void DenseMap::update_plan() { plan_.update(fused_.volume().space(), fused_.take_changed_space()); }

GroundPlan& DenseMap::plan() {
  CHECK(config_.keeps_plan);
  update_plan();
  return plan_;
}

void DenseMap::cull(const SE3& T_world_camera) {
  const trace::Span span("cull views");
  for (const DenseViewId id : policy_.next_views(views_))
    if (policy_.is_needless(id, judge_, fused_)) remove(id);
  for (const DenseViewId id : policy_.crowded_out(T_world_camera, judge_, fused_)) remove(id);
}

void DenseMap::remove(DenseViewId id) {
  fused_.remove(id);
  judge_.forget(id, views_.at(id).stamp);
  policy_.forget(id);
  views_.remove(id);
  synced_at_.erase(id);
  refused_.erase(id);
}

void DenseMap::take_in_new_frames() {
  std::vector<DenseViewId> missing;
  bool has_frames = false;
  for (const auto& [id, view] : views_.all()) {
    if (!fused_.contains(id)) missing.push_back(id);
    has_frames = has_frames || (view.T_world_camera && policy_.is_undecided(id, view));
  }
  if (!has_frames) return;
  // Whether a frame shows something new depends on what those before it showed.
  for (const DenseViewId id : missing)
    if (!drop_needless(id)) bring_up_to_date(id);
}

FusedVolume::Placements DenseMap::wanted() const {
  FusedVolume::Placements wanted;
  for (const auto& [id, view] : views_.all())
    if (const PixelState* state = judge_.state(id); state != nullptr && view.T_world_camera)
      wanted.emplace(id, ViewPlacement{view.images, view.stamp, *view.T_world_camera, *state});
  return wanted;
}

void DenseMap::finish() {
  if (is_finished_) return;
  std::map<DenseViewId, SE3> T_world_before;
  for (const DenseViewId id : fused_.ids())
    T_world_before.emplace(id, fused_.find(id)->T_world_camera);
  take_in_new_frames();
  judge_.judge_objects(views_, fused_);
  judge_.judge_space(fused_);  // what was removed is all but known, so that few are put in twice
  fused_.sync(wanted());
  judge_.judge_space(fused_);
  fused_.sync(wanted());
  for (const DenseViewId id : config_.keeps_plan ? fused_.ids() : std::vector<DenseViewId>()) {
    const auto before = T_world_before.find(id);
    note_in_plan(id, before == T_world_before.end() ? std::nullopt : std::optional(before->second));
  }
  is_finished_ = true;
}

std::vector<DenseMap::PlacedView> DenseMap::views() const {
  std::vector<PlacedView> views;
  for (const DenseViewId id : fused_.ids()) {
    const ViewPlacement& view = *fused_.find(id);
    views.push_back({id, view.stamp, view.T_world_camera, view.images.get()});
  }
  return views;
}

std::size_t DenseMap::memory_bytes() const {
  return views_.memory_bytes() + fused_.memory_bytes() + policy_.memory_bytes() +
         plan_.memory_bytes();
}

}  // namespace ygslam
