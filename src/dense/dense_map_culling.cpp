// Which frames between keyframes stay in a dense map, and which go again.
#include <algorithm>
#include <iterator>
#include <map>

#include "dense/dense_map.hpp"
#include "dense/pose_distance.hpp"

namespace ygslam {
namespace {

constexpr int kCulledAtOnce = 8;  // views looked at

}  // namespace

double DenseMap::share_of_its_own(const Contribution& old) const {
  const int enough = config_.reading.min_views + config_.spare_views + 1;  // its own is one
  return old.sample->share_seen_less(enough, *old.fused, volume_.surface());
}

bool DenseMap::is_needed(const Contribution& old) const {
  if (old.decides_change) return true;
  if (share_of_its_own(old) >= config_.min_new) return true;
  return std::any_of(old.fused_state.ids.begin(), old.fused_state.ids.end(), [&](SceneObjectId id) {
    const auto object = objects_.objects().find(objects_.current(id));
    if (object == objects_.objects().end()) return false;
    const int views = object->second.views();
    return views >= config_.objects.min_views && views <= config_.thing_views;
  });
}

bool DenseMap::may_go(const Contribution& old) const {
  return old.sample && old.fused &&
         seconds_between(objects_.now(), old.stamp) > config_.protected_s;
}

void DenseMap::remove(std::map<DenseViewId, Contribution>::iterator old) {
  take_back(old->second);
  objects_.forget(old->second.stamp);
  contributions_.erase(old);
}

void DenseMap::thin_out(const SE3& T_world_camera) {
  std::multimap<double, std::map<DenseViewId, Contribution>::iterator> near;
  for (auto at = contributions_.begin(); at != contributions_.end(); ++at) {
    const Contribution& old = at->second;
    if (may_go(old) && distance_m(*old.fused, T_world_camera) < config_.near_m)
      near.emplace(share_of_its_own(old) + (old.decides_change ? 1 : 0), at);
  }
  for (auto at = near.begin(); std::distance(at, near.end()) > config_.most_near; ++at)
    remove(at->second);
}

void DenseMap::cull() {
  auto at = contributions_.upper_bound(culled_up_to_);
  for (int i = 0; i < kCulledAtOnce && at != contributions_.end(); ++i) {
    const auto looked_at = at++;
    culled_up_to_ = looked_at->first;
    Contribution& old = looked_at->second;
    if (may_go(old) && !is_needed(old)) remove(looked_at);
  }
  if (at == contributions_.end()) culled_up_to_ = {KeyframeId{0}};
}

}  // namespace ygslam
