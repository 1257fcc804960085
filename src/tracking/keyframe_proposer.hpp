// Which frames the tracker offers to the mapper, and what it tells with them.
#pragma once

#include <unordered_map>
#include <vector>

#include "map/local_view.hpp"
#include "tracking/keyframe_policy.hpp"
#include "tracking/pose_estimator.hpp"
#include "tracking/tracked_frame.hpp"

namespace ygslam {

inline constexpr float kMappedWeight = 0.5F;  ///< a static point of this weight may enter the map

class KeyframeProposer {
 public:
  /// @param min_points fewer mappable features: what covers the view would be mapped. Where depth
  /// is missing three times as many that can be triangulated will do.
  KeyframeProposer(const KeyframePolicyConfig& config, int min_points)
      : config_(config), min_points_(min_points) {}

  /// Once per frame that was matched with the map.
  void count_frame() { ++frames_since_keyframe_; }
  /// The next keyframe is not due before max_interval_frames.
  void restart() { frames_since_keyframe_ = 0; }
  void remember_seen(const std::vector<KeyframeCandidate::Seen>& seen);

  /// A tracked frame.
  [[nodiscard]] bool wants(const TrackedFrame& frame, const LocalView& view, const PoseResult& pose,
                           bool mapper_busy) const;
  /// Hands the frame to the mapper, with what was seen since the last candidate.
  /// @param map_version of the view it was tracked in.
  [[nodiscard]] KeyframeCandidate make(const TrackedFrame& frame, std::uint64_t map_version);
  /// The same of the first frame of a submap; see KeyframeCandidate::submap_reach_m.
  [[nodiscard]] KeyframeCandidate make_submap(const TrackedFrame& frame, double reach_m,
                                              std::uint64_t map_version);

 private:
  [[nodiscard]] bool is_mappable(const FrameFeatures& seen, const PoseResult& pose) const;
  void compare_with_nearest(const TrackedFrame& frame, const LocalView& view,
                            KeyframeEvidence& evidence) const;

  KeyframePolicyConfig config_;
  int min_points_;
  int frames_since_keyframe_ = 0;
  std::uint64_t map_version_ = 0;  // of the last candidate: no view since is older
  std::unordered_map<LandmarkId, KeyframeCandidate::Seen> seen_;  // since the last candidate
  std::vector<LandmarkId> seen_order_;
};

}  // namespace ygslam
