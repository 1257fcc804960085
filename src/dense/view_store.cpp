#include "dense/view_store.hpp"

#include <limits>
#include <utility>

#include "dense/pose_distance.hpp"

namespace ygslam {
namespace {

DenseViewId next_id(const ViewStore::Views& views, KeyframeId keyframe) {
  const auto after = views.upper_bound({keyframe, std::numeric_limits<std::uint32_t>::max()});
  if (after == views.begin()) return {keyframe, 1};
  const DenseViewId last = std::prev(after)->first;
  return {keyframe, last.keyframe == keyframe ? last.number + 1 : 1};
}

}  // namespace

DenseViewId ViewStore::add(KeyframeId keyframe, DenseView view) {
  const DenseViewId id = view.anchor ? next_id(views_, keyframe) : DenseViewId(keyframe);
  views_.emplace(id, std::move(view));
  return id;
}

void ViewStore::reanchor(const RemovedAnchor& removed) {
  if (const auto own = views_.find(removed.id); own != views_.end())
    own->second.anchor = {removed.id, own->second.stamp, SE3()};
  for (auto& [id, view] : views_) {
    if (!view.anchor || view.anchor->keyframe != removed.id) continue;
    const SE3 T_camera_removed = view.anchor->T_camera_keyframe;
    view.anchor = removed.now;
    view.anchor->T_camera_keyframe = T_camera_removed * removed.now.T_camera_keyframe;
  }
}

bool ViewStore::set_poses(const std::map<KeyframeId, SE3>& T_world_camera) {
  bool has_changed = false;
  for (auto& [id, view] : views_) {
    const auto pose = T_world_camera.find(view.anchor ? view.anchor->keyframe : id.keyframe);
    const std::optional<SE3> before = std::exchange(view.T_world_camera, std::nullopt);
    if (pose != T_world_camera.end())
      view.T_world_camera =
          view.anchor ? pose->second * view.anchor->T_camera_keyframe.inverse() : pose->second;
    has_changed = has_changed || !same(before, view.T_world_camera);
  }
  return has_changed;
}

void ViewStore::restore(const SavedView& saved) {
  views_.emplace(saved.id, DenseView{saved.view, saved.things, saved.stamp, saved.anchor});
}

std::vector<SavedView> ViewStore::saved() const {
  std::vector<SavedView> saved;
  for (const auto& [id, view] : views_) {
    if (!view.T_world_camera) continue;
    saved.push_back({id, view.stamp, view.observations, view.images, view.anchor});
  }
  return saved;
}

std::size_t ViewStore::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, view] : views_) {
    bytes += view.images->bytes();
    for (const ObjectObservation& observation : view.observations)
      bytes += observation.p_camera.capacity() * sizeof(Eigen::Vector3f);
  }
  return bytes;
}

}  // namespace ygslam
