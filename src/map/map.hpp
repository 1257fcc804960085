// Keyframes and landmarks with their mutual references: a plain value that can be copied, patched
// (map_patch.hpp) and saved (map_file/). The mapping stage alone writes the map
// of a run; everyone else reads copies and published views (local_view.hpp).
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "features/pyramid_scales.hpp"
#include "geometry/packed_pose.hpp"
#include "map/keyframe.hpp"
#include "map/landmark.hpp"
#include "map/map_identity.hpp"
#include "map/map_patch.hpp"

namespace ygslam {

/// Where a keyframe that is no longer in the map was, so that frames that refer to it keep a pose:
/// 64 bytes for each, all that a walk over known ground adds to a map in the end.
struct RemovedKeyframe {
  KeyframeId id = kNoKeyframe;
  KeyframeId parent = kNoKeyframe;  ///< in the map, or removed itself in a map that was loaded
  PackedPose T_camera_parent;
};

class Map {
 public:
  /// @param scales of the feature pyramid, for the distances at which a landmark can be seen.
  explicit Map(PyramidScales scales) : scales_(std::move(scales)) {}

  /// Kept while the map goes on, in copies and files, too. Whoever begins a map may give it one;
  /// else its first keyframe does. Nothing while it has neither.
  [[nodiscard]] const std::optional<MapIdentity>& identity() const { return identity_; }
  void set_identity(const std::optional<MapIdentity>& identity) { identity_ = identity; }

  // Keyframes, ascending id.
  void add_keyframe(KeyframeDataPtr data, const SE3& T_camera_world, KeyframeId parent,
                    std::vector<float> static_weight);
  /// Takes it out of every landmark; its children are given its parent, and its motion.
  void remove_keyframe(KeyframeId id);
  [[nodiscard]] bool has_keyframe(KeyframeId id) const { return keyframes_.contains(id); }
  [[nodiscard]] const Keyframe& keyframe(KeyframeId id) const;
  void set_pose(KeyframeId id, const SE3& T_camera_world);
  void set_static_weight(KeyframeId id, std::vector<float> weight);
  /// @param motion from a keyframe that was made before, and may have been removed.
  void set_motion(KeyframeId id, const KeyframeMotion& motion);
  /// What was seen stays, where it was seen is known better. @param data of as many features.
  void set_data(KeyframeId id, KeyframeDataPtr data);
  [[nodiscard]] const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  /// The newest kept pose of a keyframe that may have been removed: T_camera_world through its
  /// nearest kept ancestor.
  /// kNoKeyframe stands for origin().
  [[nodiscard]] SE3 resolved_pose(KeyframeId id) const;
  [[nodiscard]] KeyframeId next_keyframe_id() const { return KeyframeId{next_keyframe_}; }
  /// The first keyframe; in a map that was loaded the root of its largest submap. kNoKeyframe in an
  /// empty map.
  [[nodiscard]] KeyframeId origin() const { return origin_; }
  /// Itself, or of a keyframe that was removed its nearest kept ancestor.
  [[nodiscard]] KeyframeId nearest_kept(KeyframeId id) const;

  // Submaps: where the camera was lost a new one began, whose place in the world is a guess until
  // it is joined. Each is a tree; the keyframe without a parent is its root, and is never removed.
  /// Of a keyframe in the map.
  [[nodiscard]] KeyframeId root_of(KeyframeId id) const;
  /// Of every keyframe.
  [[nodiscard]] std::map<KeyframeId, KeyframeId> roots() const;
  /// The root of what is said to be the world at the end: the submap with most keyframes, or what
  /// was there before this run.
  [[nodiscard]] KeyframeId main_root() const;
  /// Ends a submap: its root becomes a child of an older keyframe. Poses stay.
  void join(KeyframeId root, KeyframeId parent);
  /// The keyframe made of a frame of this run, kept or removed; kNoKeyframe if there is none.
  /// A map that was loaded knows no frames.
  [[nodiscard]] KeyframeId keyframe_of(FrameId frame) const;
  /// Another run goes on with the map: its frames are not those that keyframes were made of, nor is
  /// its IMU that which told of them. As a map that was loaded.
  void forget_frames();
  /// Ascending id.
  [[nodiscard]] const std::deque<RemovedKeyframe>& removed_keyframes() const {
    return removed_keyframes_;
  }

  // Corrections.
  /// Grows with every change of what there is and where it is; not with what is counted of it.
  [[nodiscard]] std::uint64_t version() const { return version_; }
  /// A patch against this map that changes nothing yet.
  [[nodiscard]] MapPatch start_patch() const { return {next_keyframe_id(), {}, {}}; }
  /// Takes a correction over. What came or changed since it was started is carried along:
  /// a keyframe that moved keeps that motion, a later one follows its parent, a landmark that is
  /// not named or has moved follows the keyframe that first saw it. What is gone is skipped.
  /// @return true if it bent the map, false if all keyframes moved as one.
  bool apply(const MapPatch& patch);

  // Landmarks.
  LandmarkId add_landmark(const Vec3& p_world, KeyframeId keyframe, std::uint32_t feature);
  void remove_landmark(LandmarkId id);
  [[nodiscard]] bool has_landmark(LandmarkId id) const { return landmarks_.contains(id); }
  [[nodiscard]] const Landmark& landmark(LandmarkId id) const;
  void set_position(LandmarkId id, const Vec3& p_world);
  void count_seen(LandmarkId id, int visible, int found);
  void set_seen_through(LandmarkId id, int keyframes);
  [[nodiscard]] std::size_t landmark_count() const { return landmarks_.size(); }
  [[nodiscard]] LandmarkId next_landmark_id() const { return LandmarkId{next_landmark_}; }

  // Observations. A feature shows at most one landmark, a landmark at most once per keyframe.
  /// @return false if the feature is taken or the keyframe sees the landmark already.
  bool add_observation(LandmarkId id, KeyframeId keyframe, std::uint32_t feature);
  /// Landmarks that lose their last observation are removed.
  void remove_observation(LandmarkId id, KeyframeId keyframe);
  /// Moves the observations of `from` to `into` and removes `from`.
  void fuse(LandmarkId from, LandmarkId into);
  /// Fusions up to a version are forgotten: nobody asks for the landmarks that went in them.
  void forget_fusions(std::uint64_t up_to_version);
  /// Where a fused landmark went; kNoLandmark if it is gone for good.
  [[nodiscard]] LandmarkId current_id(LandmarkId id) const;
  /// Recomputes descriptor, normal and distances from the observations.
  void refresh(LandmarkId id);

  /// Keyframes that share at least min_shared landmarks, most first, at most max_count.
  [[nodiscard]] std::vector<KeyframeId> covisible(KeyframeId id, int min_shared,
                                                  std::size_t max_count) const;
  /// The same behind the keyframe itself.
  [[nodiscard]] std::vector<KeyframeId> with_covisible(KeyframeId id, int min_shared,
                                                       std::size_t max_count) const;
  /// The landmarks that any of the keyframes sees, ascending.
  [[nodiscard]] std::vector<LandmarkId> landmarks_of(std::span<const KeyframeId> keyframes) const;
  /// Calls visit(landmark) in no particular order.
  template <typename Visit>
  void for_each_landmark(Visit&& visit) const {
    for (const auto& [id, landmark] : landmarks_) visit(landmark);
  }

  [[nodiscard]] const PyramidScales& scales() const { return scales_; }

 private:
  [[nodiscard]] KeyframeId largest_root() const;
  Landmark& mutable_landmark(LandmarkId id);
  /// Null for a keyframe that was never removed.
  [[nodiscard]] const RemovedKeyframe* removed(KeyframeId id) const;
  void change_covisibility(const Landmark& landmark, KeyframeId keyframe, int change);

  struct Moved {
    SE3 T_camera_world;  // after the patch
    SE3 T_new_old;       // how the world around the keyframe goes with it
  };
  /// What apply() does to the keyframes; those that the patch leaves alone are not in it.
  [[nodiscard]] std::map<KeyframeId, Moved> moved_by(const MapPatch& patch) const;
  void apply_points(const MapPatch& patch, const std::map<KeyframeId, Moved>& moved);

  struct Fused {
    LandmarkId into = kNoLandmark;
    std::uint64_t version = 0;  // of the map it happened in
  };
  std::map<KeyframeId, Keyframe> keyframes_;
  std::deque<RemovedKeyframe> removed_keyframes_;           // ascending id
  std::deque<std::pair<FrameId, KeyframeId>> keyframe_of_;  // ascending frame
  std::unordered_map<LandmarkId, Landmark> landmarks_;      // no result depends on its order
  std::unordered_map<LandmarkId, Fused> fused_;
  PyramidScales scales_;
  std::optional<MapIdentity> identity_;
  KeyframeId origin_ = kNoKeyframe;
  int roots_ = 0;
  std::uint32_t next_keyframe_ = 0;
  std::uint32_t next_landmark_ = 0;
  std::uint64_t version_ = 0;

  friend class MapAssembly;
};

}  // namespace ygslam
