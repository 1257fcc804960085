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

}  // namespace ygslam
