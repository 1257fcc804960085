#include "tracking/view_poses.hpp"

#include <algorithm>
#include <utility>

namespace ygslam {
namespace {

constexpr double kClearlyMore = 1.5;  // times as many shared landmarks

}  // namespace

KeyframeRelativePose relative_to_keyframe(const SE3& T_camera_world, const LocalView& view) {
  if (view.empty()) return {kNoKeyframe, T_camera_world};
  const ViewKeyframe& reference = view.reference();
  return {reference.data->id, T_camera_world * reference.T_camera_world.inverse()};
}

std::optional<SE3> pose_in(const LocalView& view, const KeyframeRelativePose& pose) {
  const auto T_reference_world = view.pose_of(pose.reference);
  if (!T_reference_world) return std::nullopt;
  return pose.T_camera_reference * *T_reference_world;
}

std::optional<KeyframeId> better_reference(const TrackedFrame& frame, const LocalView& view) {
  std::vector<std::uint8_t> seen(view.landmarks.size(), 0);
  for (const LandmarkId id : frame.landmarks)
    if (const std::int32_t i = view.find(id); i >= 0) seen[i] = 1;
  const auto shared = [&](const ViewKeyframe& keyframe) {
    return std::count_if(keyframe.landmarks.begin(), keyframe.landmarks.end(),
                         [&](std::int32_t i) { return i >= 0 && seen[i] != 0; });
  };
  const auto best = std::max_element(
      view.keyframes.begin(), view.keyframes.end(),
      [&](const ViewKeyframe& a, const ViewKeyframe& b) { return shared(a) < shared(b); });
  if (best == view.keyframes.end()) return std::nullopt;
  if (static_cast<double>(shared(*best)) <=
      kClearlyMore * static_cast<double>(shared(view.reference())))
    return std::nullopt;
  return best->data->id;
}

std::optional<KeyframeId> nearest_reference(const SE3& T_camera_world, const LocalView& view) {
  if (view.empty()) return std::nullopt;
  constexpr double kRadPerMetre = 0.5;  // a turn hides as much of a room as some metres do
  const auto distance = [&](const ViewKeyframe& keyframe) {
    return (T_camera_world * keyframe.T_camera_world.inverse()).angle() +
           kRadPerMetre * centre_distance_m(T_camera_world, keyframe.T_camera_world);
  };
  const auto nearest = std::min_element(
      view.keyframes.begin(), view.keyframes.end(),
      [&](const ViewKeyframe& a, const ViewKeyframe& b) { return distance(a) < distance(b); });
  if (nearest->data->id == view.reference().data->id) return std::nullopt;
  return nearest->data->id;
}

TrackedFrame with_pose(FrameFeatures seen, const PoseResult& pose, const LocalViewPtr& view,
                       const SE3& T_odom_camera) {
  return {
      std::move(seen),     pose.landmarks, relative_to_keyframe(pose.T_camera_world, *view), view,
      pose.T_camera_world, T_odom_camera};
}

TrackedFrame without_landmarks(FrameFeatures seen, const KeyframeRelativePose& pose,
                               const LocalViewPtr& view, const SE3& T_odom_camera) {
  std::vector<LandmarkId> none(seen.features->size(), kNoLandmark);
  return {std::move(seen), std::move(none), pose, view, SE3(), T_odom_camera};
}

double centre_distance_m(const SE3& T_a_world, const SE3& T_b_world) {
  return (T_a_world.inverse().t() - T_b_world.inverse().t()).norm();
}

}  // namespace ygslam
