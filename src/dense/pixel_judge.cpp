#include "dense/pixel_judge.hpp"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "core/trace.hpp"
#include "dense/pose_distance.hpp"

namespace ygslam {
namespace {

RemovedCells with_cells(const RemovedCells& known, const std::vector<SpaceIndex>& more,
                        double cell_m) {
  std::vector<CellKey> keys = known ? *known : std::vector<CellKey>();
  for (const SpaceIndex& cell : more)
    keys.push_back(cell_key((cell.cast<double>() + Vec3::Constant(0.5)) * cell_m, cell_m));
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return std::make_shared<const std::vector<CellKey>>(std::move(keys));
}

std::shared_ptr<const std::vector<SpaceIndex>> with_cells(
    const std::shared_ptr<const std::vector<SpaceIndex>>& known,
    const std::vector<SpaceIndex>& more) {
  std::vector<SpaceIndex> cells = known ? *known : std::vector<SpaceIndex>();
  cells.insert(cells.end(), more.begin(), more.end());
  const auto order = [](const SpaceIndex& c) { return std::tuple(c.z(), c.y(), c.x()); };
  std::sort(cells.begin(), cells.end(),
            [&](const SpaceIndex& a, const SpaceIndex& b) { return order(a) < order(b); });
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return std::make_shared<const std::vector<SpaceIndex>>(std::move(cells));
}

constexpr std::size_t kJudgedAtOnce = 16;  // views: whoever waits for the map waits for them

}  // namespace

/// In the views that showed an object which was removed: its pixels.
void PixelJudge::remove_pixels_of(SceneObjectId removed, Objects& objects) {
  const KnownObject& object = objects.map.objects().at(removed);
  const auto place = std::make_shared<const std::vector<CellKey>>(object.place());
  for (auto& [id, judged] : objects.judged) {
    if (!object.shown.contains(judged.stamp)) continue;
    judged.state.removed_objects.push_back(place);
    for (SceneObjectId& its : judged.state.ids)
      if (objects.map.current(its) == removed) its = kRemovedObject;
  }
}

PixelJudge::PixelJudge(const DenseMapConfig& config, const Camera& camera,
                       std::shared_ptr<ViewUnpacker> unpacker)
    : config_(config),
      unpacker_(std::move(unpacker)),
      space_(config, camera),
      objects_{ObjectMap(config.objects), {}} {}

const PixelState* PixelJudge::state(DenseViewId id) const {
  const auto judged = objects_.judged.find(id);
  return judged == objects_.judged.end() ? nullptr : &judged->second.state;
}

bool PixelJudge::observes_change(const DenseView& view, FusedVolume& fused) const {
  PixelState state;
  state.ids.assign(view.observations.size(), kNoSceneObject);
  const SeenSpace& observed =
      fused.observe({view.images, view.stamp, *view.T_world_camera, std::move(state)});
  return space_.is_change(observed, fused.volume().space());
}

void PixelJudge::judge_objects(DenseViewId id, const ViewStore& views, const FusedVolume& fused) {
  judge(id, views, fused, objects_);
}

void PixelJudge::judge(DenseViewId id, const ViewStore& views, const FusedVolume& fused,
                       Objects& objects) const {
  const trace::Span span("judge objects");
  const DenseView& view = views.at(id);
  const SE3& T_world_camera = *view.T_world_camera;
  std::vector<SceneObjectId> removed;
  if (!objects.map.objects().empty())
    removed =
        objects.map.check_places(unpacker_->unpacked(view.images), T_world_camera, view.stamp);
  PixelState state{objects.map.step(view.observations, T_world_camera, view.stamp), {}, {}, {}};
  if (const ViewPlacement* now = fused.find(id)) {
    state.removed = now->state.removed;
    state.appeared = now->state.appeared;
  }
  objects.judged.insert_or_assign(id, Judged{view.stamp, T_world_camera, std::move(state)});
  for (const SceneObjectId object : removed) remove_pixels_of(object, objects);
}

void PixelJudge::judge_objects(const ViewStore& views, const FusedVolume& fused) {
  anew_.reset();
  judge_anew(std::numeric_limits<std::size_t>::max(), views, fused);
}

void PixelJudge::judge_anew(std::size_t most_views, const ViewStore& views,
                            const FusedVolume& fused) {
  if (!anew_) anew_ = Anew{{ObjectMap(config_.objects), {}}, {}};
  auto next = anew_->last ? views.all().upper_bound(*anew_->last) : views.all().begin();
  for (; most_views > 0 && next != views.all().end(); ++next) {
    const auto& [id, view] = *next;
    anew_->last = id;
    if (!view.T_world_camera) continue;
    judge(id, views, fused, anew_->objects);
    --most_views;
  }
  if (next != views.all().end()) return;
  objects_ = std::move(anew_->objects);
  anew_.reset();
  for (auto& [id, judged] : objects_.judged)
    for (SceneObjectId& object : judged.state.ids) object = objects_.map.current(object);
  is_space_judged_ = false;
}

void PixelJudge::judge_space(FusedVolume& fused) {
  const trace::Span span("judge space");
  for (auto& [id, judged] : objects_.judged)
    judged.state = without_changes(std::move(judged.state));
  deciding_.clear();
  take(space_.judge(fused));
  is_space_judged_ = true;
}

void PixelJudge::judge_space(DenseViewId id, FusedVolume& fused) {
  const trace::Span span("judge space");
  take(space_.judge(fused, id));
}

void PixelJudge::take(const SpaceVerdict& verdict) {
  for (const auto& [id, cells] : verdict.cells) {
    const auto judged = objects_.judged.find(id);
    if (judged == objects_.judged.end()) continue;
    PixelState& state = judged->second.state;
    if (!cells.removed.empty())
      state.removed = with_cells(state.removed, cells.removed, config_.objects.cell_m);
    if (!cells.appeared.empty()) state.appeared = with_cells(state.appeared, cells.appeared);
  }
  deciding_.insert(verdict.deciding.begin(), verdict.deciding.end());
}

bool PixelJudge::was_corrected(const ViewStore& views) const {
  return std::any_of(views.all().begin(), views.all().end(), [&](const auto& entry) {
    const auto& [id, view] = entry;
    const auto judged = objects_.judged.find(id);
    if (!view.T_world_camera || judged == objects_.judged.end()) return false;
    const PixelState& state = judged->second.state;
    const bool depends_on_pose = !view.observations.empty() || state.removed || state.appeared;
    return depends_on_pose &&
           distance_m(judged->second.T_world_camera, *view.T_world_camera) > config_.objects.cell_m;
  });
}

bool PixelJudge::judge_corrected(const ViewStore& views, FusedVolume& fused) {
  if (!is_space_judged_) {
    judge_space(fused);
    return true;
  }
  if (!anew_ && !was_corrected(views)) return false;
  judge_anew(kJudgedAtOnce, views, fused);
  return true;
}

void PixelJudge::forget(DenseViewId id, Timestamp stamp) {
  objects_.map.forget(stamp);
  objects_.judged.erase(id);
  deciding_.erase(id);
  if (!anew_ || !anew_->objects.judged.erase(id)) return;
  anew_->objects.map.forget(stamp);
}

}  // namespace ygslam
