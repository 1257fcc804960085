#include "tracking/keyframe_proposer.hpp"

namespace ygslam {

bool KeyframeProposer::wants(const TrackedFrame& frame, const LocalView& view,
                             const PoseResult& pose, bool mapper_busy) const {
  if (frame.usable_points(kMappedWeight) < min_points_) return false;
  KeyframeEvidence evidence;
  evidence.frames_since_last = frames_since_keyframe_;
  evidence.tracked_landmarks = pose.landmark_inliers;
  evidence.reference_landmarks = view.reference().tracked_landmarks;
  evidence.T_camera_reference = frame.pose.T_camera_reference;
  evidence.mapper_busy = mapper_busy;
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const float depth_m = frame.features->points[i].depth_m;
    if (depth_m <= 0 || frame.static_weight[i] < kMappedWeight) continue;
    if (depth_m > config_.close_depth_m) continue;
    ++(frame.landmarks[i] != kNoLandmark ? evidence.close_tracked : evidence.close_untracked);
  }
  return wants_keyframe(evidence, config_);
}

void KeyframeProposer::remember_seen(const std::vector<KeyframeCandidate::Seen>& seen) {
  for (const auto& s : seen) {
    const auto [it, is_new] = seen_.try_emplace(s.id, KeyframeCandidate::Seen{s.id, 0, 0});
    if (is_new) seen_order_.push_back(s.id);
    it->second.visible += s.visible;
    it->second.found += s.found;
  }
}

KeyframeCandidate KeyframeProposer::make(const TrackedFrame& frame, std::uint64_t map_version) {
  KeyframeCandidate candidate{
      frame.frame, frame.features, frame.read_out, frame.landmarks, frame.static_weight, frame.pose,
      {},          map_version_};
  for (const LandmarkId id : seen_order_) candidate.seen.push_back(seen_.at(id));
  seen_.clear();
  seen_order_.clear();
  frames_since_keyframe_ = 0;
  map_version_ = map_version;
  return candidate;
}

}  // namespace ygslam
