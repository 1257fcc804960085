// Keyframes and landmarks with their mutual references. Written by the mapping stage alone;
// everyone else reads published views (local_view.hpp).
#pragma once

#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "map/keyframe.hpp"
#include "map/landmark.hpp"

namespace ygslam {

class Map {
 public:
  /// @param levels, scale of the feature pyramid, for the distances at which a landmark can be
  /// seen.
  Map(int pyramid_levels, double pyramid_scale);

  // Keyframes, ascending id.
  Keyframe& add_keyframe(KeyframeDataPtr data, const SE3& T_camera_world, KeyframeId parent,
                         std::vector<float> static_weight);
  /// Takes it out of every landmark; its children are given its parent.
  void remove_keyframe(KeyframeId id);
  [[nodiscard]] bool has_keyframe(KeyframeId id) const { return keyframes_.contains(id); }
  [[nodiscard]] const Keyframe& keyframe(KeyframeId id) const;
  void set_pose(KeyframeId id, const SE3& T_camera_world);
  void set_static_weight(KeyframeId id, std::vector<float> weight);
  [[nodiscard]] const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  /// The newest kept pose of a keyframe that may have been removed: T_camera_world through its
  /// nearest kept ancestor.
  [[nodiscard]] SE3 resolved_pose(KeyframeId id) const;
  [[nodiscard]] std::uint64_t next_keyframe_id() const { return next_keyframe_; }

  // Landmarks.
  LandmarkId add_landmark(const Vec3& p_world, KeyframeId keyframe, std::uint32_t feature);
  void remove_landmark(LandmarkId id);
  [[nodiscard]] bool has_landmark(LandmarkId id) const { return landmarks_.contains(id); }
  [[nodiscard]] const Landmark& landmark(LandmarkId id) const;
  void set_position(LandmarkId id, const Vec3& p_world);
  void count_seen(LandmarkId id, int visible, int found);
  [[nodiscard]] std::size_t landmark_count() const { return landmarks_.size(); }

  // Observations. A feature shows at most one landmark, a landmark at most once per keyframe.
  /// @return false if the feature is taken or the keyframe sees the landmark already.
  bool add_observation(LandmarkId id, KeyframeId keyframe, std::uint32_t feature);
  /// Landmarks that lose their last observation are removed.
  void remove_observation(LandmarkId id, KeyframeId keyframe);
  /// Moves the observations of `from` to `into` and removes `from`.
  void fuse(LandmarkId from, LandmarkId into);
  /// Where a fused landmark went; kNoLandmark if it is gone for good.
  [[nodiscard]] LandmarkId current_id(LandmarkId id) const;
  /// Recomputes descriptor, normal and distances from the observations.
  void refresh(LandmarkId id);

  /// Keyframes that share at least min_shared landmarks, most first, at most max_count.
  [[nodiscard]] std::vector<KeyframeId> covisible(KeyframeId id, int min_shared,
                                                  std::size_t max_count) const;
  [[nodiscard]] double octave_scale(int octave) const { return octave_scale_[octave]; }
  [[nodiscard]] int octaves() const { return static_cast<int>(octave_scale_.size()); }

 private:
  Landmark& mutable_landmark(LandmarkId id);
  void change_covisibility(const Landmark& landmark, KeyframeId keyframe, int change);

  struct Removed {
    KeyframeId parent = kNoKeyframe;
    SE3 T_camera_parent;
  };
  std::map<KeyframeId, Keyframe> keyframes_;
  std::map<KeyframeId, Removed> removed_keyframes_;
  std::unordered_map<LandmarkId, Landmark> landmarks_;  // looked up, never iterated
  std::unordered_map<LandmarkId, LandmarkId> fused_;
  std::vector<double> octave_scale_;
  std::uint32_t next_keyframe_ = 0;
  std::uint32_t next_landmark_ = 0;
};

}  // namespace ygslam
