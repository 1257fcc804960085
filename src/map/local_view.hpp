// What the tracker sees of the map: an immutable snapshot around one keyframe.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "map/keyframe.hpp"
#include "map/landmark.hpp"

namespace ygslam {

struct ViewLandmark {
  LandmarkId id = kNoLandmark;
  Vec3 p_world = Vec3::Zero();
  Vec3 normal_world = Vec3::Zero();
  Descriptor descriptor;
  double min_distance_m = 0;
  double max_distance_m = 0;
};

struct ViewKeyframe {
  KeyframeDataPtr data;
  SE3 T_camera_world;
  std::vector<std::int32_t> landmarks;  ///< per feature: index into LocalView::landmarks, or -1
  int tracked_landmarks = 0;  ///< landmarks it sees that at least two other keyframes see too
};

/// A keyframe of which the view has the pose alone.
struct KeyframePose {
  KeyframeId id = kNoKeyframe;
  SE3 T_camera_world;
};

struct LocalView {
  std::uint64_t map_version = 0;   ///< Map::version()
  std::uint32_t deformations = 0;  ///< corrections so far that did not move all as one
  std::vector<ViewLandmark> landmarks;
  std::unordered_map<LandmarkId, std::uint32_t> landmark_index;
  std::vector<ViewKeyframe> keyframes;  ///< the reference first, then the most covisible
  std::vector<KeyframePose> others;     ///< the run's first keyframe, references of earlier views
  KeyframeId origin = kNoKeyframe;      ///< the map's first keyframe
  bool placed = true;                   ///< false: of a submap whose place in the world is a guess

  [[nodiscard]] bool empty() const { return keyframes.empty(); }
  [[nodiscard]] const ViewKeyframe& reference() const { return keyframes.front(); }
  /// T_camera_world of a keyframe, kNoKeyframe for the run's first; nullopt if it is not in view.
  [[nodiscard]] std::optional<SE3> pose_of(KeyframeId id) const {
    if (id == kNoKeyframe) id = origin;
    for (const ViewKeyframe& keyframe : keyframes)
      if (keyframe.data->id == id) return keyframe.T_camera_world;
    for (const KeyframePose& other : others)
      if (other.id == id) return other.T_camera_world;
    return std::nullopt;
  }
  /// Index into landmarks, or -1, also of kNoLandmark.
  [[nodiscard]] std::int32_t find(LandmarkId id) const {
    const auto it = landmark_index.find(id);
    return it == landmark_index.end() ? -1 : static_cast<std::int32_t>(it->second);
  }
  /// Null for one that is not in view, and for kNoLandmark.
  [[nodiscard]] const ViewLandmark* landmark(LandmarkId id) const {
    const std::int32_t i = find(id);
    return i < 0 ? nullptr : &landmarks[static_cast<std::size_t>(i)];
  }
};
using LocalViewPtr = std::shared_ptr<const LocalView>;

}  // namespace ygslam
