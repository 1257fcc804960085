// Corrections of the map: Map::apply() and its steps.
#include <algorithm>

#include "map/map.hpp"

namespace ygslam {
namespace {

constexpr double kSameMotion = 1e-9;  // of a twist [m, rad]: rounding

}  // namespace

bool Map::apply(const MapPatch& patch) {
  const std::map<KeyframeId, Moved> moved = moved_by(patch);
  for (const auto& [id, by] : moved) set_pose(id, by.T_camera_world);
  apply_points(patch, moved);
  for (const MapPatch::Split& s : patch.splits) split(s);
  for (const MapPatch::Observation& dropped : patch.dropped) {
    if (!has_landmark(dropped.landmark)) continue;
    remove_observation(dropped.landmark, dropped.keyframe);
    if (has_landmark(dropped.landmark)) refresh(dropped.landmark);
  }
  for (const MapPatch::Fusion& fusion : patch.fusions) {
    const LandmarkId from = current_id(fusion.from);
    const LandmarkId into = current_id(fusion.into);
    if (from != kNoLandmark && into != kNoLandmark && from != into) fuse(from, into);
  }
  const auto moved_otherwise = [&](const auto& entry) {
    const SE3 difference = moved.begin()->second.T_new_old.inverse() * entry.second.T_new_old;
    return difference.log().norm() > kSameMotion;
  };
  return moved.size() != keyframes_.size() ||
         std::any_of(moved.begin(), moved.end(), moved_otherwise);
}

std::map<KeyframeId, Map::Moved> Map::moved_by(const MapPatch& patch) const {
  std::map<KeyframeId, Moved> moved;
  for (const MapPatch::Pose& pose : patch.poses) {
    const auto it = keyframes_.find(pose.keyframe);
    if (it == keyframes_.end()) continue;
    const SE3 T_new_old = pose.T_camera_world.inverse() * pose.T_camera_base;
    const SE3& T_now = it->second.T_camera_world;
    const bool unmoved = T_now.R() == pose.T_camera_base.R() && T_now.t() == pose.T_camera_base.t();
    moved[pose.keyframe] = {unmoved ? pose.T_camera_world : T_now * T_new_old.inverse(), T_new_old};
  }
  for (auto it = keyframes_.lower_bound(patch.first_later); it != keyframes_.end(); ++it) {
    const auto parent = moved.find(it->second.parent);
    if (parent == moved.end() || moved.contains(it->first)) continue;
    const SE3 T_new_old = parent->second.T_new_old;
    moved[it->first] = {it->second.T_camera_world * T_new_old.inverse(), T_new_old};
  }
  return moved;
}

void Map::apply_points(const MapPatch& patch, const std::map<KeyframeId, Moved>& moved) {
  std::unordered_map<LandmarkId, Vec3> named;
  for (const MapPatch::Point& point : patch.points) {
    const auto it = landmarks_.find(point.landmark);
    if (it != landmarks_.end() && it->second.p_world == point.p_base)
      named[point.landmark] = point.p_world;
  }
  // What a landmark looks like from where does not change: its keyframe's correction turns it.
  for (const auto& [id, by] : moved) {
    for (const LandmarkId landmark : keyframes_.at(id).landmarks) {
      if (landmark == kNoLandmark) continue;
      Landmark& l = landmarks_.at(landmark);
      if (l.observations.front().keyframe != id) continue;
      const auto it = named.find(landmark);
      l.p_world = it == named.end() ? by.T_new_old * l.p_world : it->second;
      l.normal_world = by.T_new_old.R() * l.normal_world;
      if (it != named.end()) named.erase(it);
    }
  }
  for (const auto& [landmark, p_world] : named) landmarks_.at(landmark).p_world = p_world;
  ++version_;
}

void Map::split(const MapPatch::Split& split) {
  const LandmarkId id =
      split.landmark == kNoLandmark ? LandmarkId{next_landmark_++} : split.landmark;
  std::vector<LandmarkId> left;
  for (const LandmarkObservation& o : split.observations) {
    const auto keyframe = keyframes_.find(o.keyframe);
    if (keyframe == keyframes_.end()) continue;
    const LandmarkId shows = keyframe->second.landmarks[o.feature];
    if (shows == id) continue;
    if (shows != kNoLandmark) {
      remove_observation(shows, o.keyframe);
      left.push_back(shows);
    }
    Landmark& landmark = landmarks_[id];
    landmark.id = id;
    add_observation(id, o.keyframe, o.feature);
  }
  const auto made = landmarks_.find(id);
  if (made != landmarks_.end()) {
    Landmark& landmark = made->second;
    landmark.p_world = split.p_world;
    landmark.first_keyframe = split.first_keyframe;
    landmark.visible = split.visible;
    landmark.found = split.found;
    fused_.erase(id);
    refresh(id);
  }
  if (has_landmark(split.from)) {
    Landmark& from = mutable_landmark(split.from);
    from.visible = std::max(1, from.visible - split.visible);
    from.found = std::clamp(from.found - split.found, 1, from.visible);
    left.push_back(split.from);
  }
  for (const LandmarkId other : left)
    if (has_landmark(other)) refresh(other);
  ++version_;
}

}  // namespace ygslam
