#include "dense/view_policy.hpp"

#include <algorithm>
#include <utility>

#include "dense/pose_distance.hpp"

namespace ygslam {
namespace {

constexpr int kSampleStep_px = 12;
constexpr std::size_t kAskedAtOnce = 8;

}  // namespace

ViewPolicy::ViewPolicy(const DenseMapConfig& config, std::shared_ptr<ViewUnpacker> unpacker)
    : config_(config), unpacker_(std::move(unpacker)) {}

bool ViewPolicy::shows_new(const DenseView& view, const SurfaceSample& sample,
                           const PixelJudge& judge, FusedVolume& fused) const {
  const SE3& T_world_camera = *view.T_world_camera;
  const ObjectMap& objects = judge.objects();
  return sample.share_seen_less(config_.reading.min_views, T_world_camera,
                                fused.volume().surface()) >= config_.min_new ||
         objects.is_poorly_known(view.observations, T_world_camera, config_.object_views) ||
         objects.observes_change(unpacker_->unpacked(view.images), T_world_camera) ||
         judge.observes_change(view, fused);
}

bool ViewPolicy::enters(DenseViewId id, const DenseView& view, const PixelJudge& judge,
                        FusedVolume& fused) {
  SurfaceSample sample(unpacker_->unpacked(view.images), config_.volume.preparation,
                       kSampleStep_px);
  if (!shows_new(view, sample, judge, fused)) return false;
  entered_.insert_or_assign(id, std::move(sample));
  return true;
}

void ViewPolicy::enter(DenseViewId id, const std::shared_ptr<const StoredView>& images) {
  entered_.insert_or_assign(
      id, SurfaceSample(unpacker_->unpacked(images), config_.volume.preparation, kSampleStep_px));
}

std::vector<DenseViewId> ViewPolicy::next_views(const ViewStore& views) {
  std::vector<DenseViewId> next;
  auto at = views.all().upper_bound(last_asked_);
  for (; next.size() < kAskedAtOnce && at != views.all().end(); ++at) next.push_back(at->first);
  if (at == views.all().end())
    last_asked_ = {KeyframeId{0}};
  else
    last_asked_ = next.back();
  return next;
}

const SurfaceSample* ViewPolicy::removable(DenseViewId id, const PixelJudge& judge,
                                           const FusedVolume& fused) const {
  const auto sample = entered_.find(id);
  const ViewPlacement* view = fused.find(id);
  if (sample == entered_.end() || view == nullptr) return nullptr;
  const double age_s = seconds_between(judge.objects().now(), view->stamp);
  return age_s > config_.protected_s ? &sample->second : nullptr;
}

double ViewPolicy::share_of_its_own(const SurfaceSample& sample, const SE3& T_world_camera,
                                    const FusedVolume& fused) const {
  const int enough = config_.reading.min_views + config_.spare_views + 1;  // its own is one
  return sample.share_seen_less(enough, T_world_camera, fused.volume().surface());
}

bool ViewPolicy::shows_rare_object(const PixelState& state, const ObjectMap& objects) const {
  return std::any_of(state.ids.begin(), state.ids.end(), [&](SceneObjectId id) {
    const auto object = objects.objects().find(objects.current(id));
    if (object == objects.objects().end()) return false;
    const int views = object->second.views();
    return views >= config_.objects.min_views && views <= config_.object_views;
  });
}

bool ViewPolicy::is_needless(DenseViewId id, const PixelJudge& judge,
                             const FusedVolume& fused) const {
  const SurfaceSample* sample = removable(id, judge, fused);
  if (sample == nullptr || judge.decides(id)) return false;
  const ViewPlacement& view = *fused.find(id);
  return share_of_its_own(*sample, view.T_world_camera, fused) < config_.min_new &&
         !shows_rare_object(view.state, judge.objects());
}

std::vector<DenseViewId> ViewPolicy::crowded_out(const SE3& T_world_camera, const PixelJudge& judge,
                                                 const FusedVolume& fused) const {
  std::multimap<double, DenseViewId> near;  // by what it shows that others do not
  for (const auto& [id, unused] : entered_) {
    const SurfaceSample* sample = removable(id, judge, fused);
    if (sample == nullptr) continue;
    const SE3& its_pose = fused.find(id)->T_world_camera;
    if (distance_m(its_pose, T_world_camera) >= config_.near_m) continue;
    near.emplace(share_of_its_own(*sample, its_pose, fused) + (judge.decides(id) ? 1 : 0), id);
  }
  std::vector<DenseViewId> out;
  for (const auto& [share, id] : near) {
    if (std::ssize(near) - std::ssize(out) <= config_.most_near) break;
    out.push_back(id);
  }
  return out;
}

std::size_t ViewPolicy::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, sample] : entered_) bytes += sample.bytes();
  return bytes;
}

}  // namespace ygslam
