#include "tracking/keyframe_proposer.hpp"

#include <algorithm>

namespace ygslam {
namespace {

// Of static features without depth so many are needed for one that can be triangulated.
constexpr int kTriangulatedShare = 3;
constexpr int kLocatedShare = 4;  // landmarks of a pose, for so many mappable features

}  // namespace

/// A camera that sways comes back to where keyframes were taken, and adds nothing.
void KeyframeProposer::compare_with_nearest(const TrackedFrame& frame, const LocalView& view,
                                            KeyframeEvidence& evidence) const {
  const SE3 T_camera_world = frame.pose.T_camera_reference * view.reference().T_camera_world;
  const auto steps = [&](const SE3& T) {  // the larger of both in what counts as having moved
    return std::max(T.t().norm() / config_.min_translation_m, T.angle() / config_.min_rotation_rad);
  };
  const KeyframeData* nearest = view.reference().data.get();
  evidence.T_camera_nearest = frame.pose.T_camera_reference;
  for (const ViewKeyframe& keyframe : view.keyframes) {
    const SE3 T_camera_keyframe = T_camera_world * keyframe.T_camera_world.inverse();
    if (steps(T_camera_keyframe) >= steps(evidence.T_camera_nearest)) continue;
    evidence.T_camera_nearest = T_camera_keyframe;
    nearest = keyframe.data.get();
  }
  evidence.nearest_age_s = seconds_between(frame.seen.frame->stamp, nearest->stamp);
}

bool KeyframeProposer::is_mappable(const FrameFeatures& seen, const PoseResult& pose) const {
  if (seen.usable_points(kMappedWeight) >= min_points_) return true;
  // Depth fails, not the view: what is static is triangulated, if the map says where the camera is.
  const auto static_points = std::ranges::count_if(
      seen.static_weight, [](float weight) { return weight >= kMappedWeight; });
  return static_points >= kTriangulatedShare * min_points_ &&
         kLocatedShare * pose.landmark_inliers >= min_points_;
}

bool KeyframeProposer::wants(const TrackedFrame& frame, const LocalView& view,
                             const PoseResult& pose, bool mapper_busy) const {
  if (!is_mappable(frame.seen, pose)) return false;
  KeyframeEvidence evidence;
  evidence.frames_since_last = frames_since_keyframe_;
  evidence.tracked_landmarks = pose.landmark_inliers;
  evidence.reference_landmarks = view.reference().tracked_landmarks;
  compare_with_nearest(frame, view, evidence);
  evidence.mapper_busy = mapper_busy;
  for (std::size_t i = 0; i < frame.seen.features->size(); ++i) {
    const float depth_m = frame.seen.features->points[i].depth_m;
    if (depth_m <= 0 || frame.seen.static_weight[i] < kMappedWeight) continue;
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
  const FrameFeatures& seen = frame.seen;
  KeyframeCandidate candidate{
      seen.frame, seen.features, seen.read_out, frame.landmarks, seen.static_weight, frame.pose,
      {},         map_version_};
  for (const LandmarkId id : seen_order_) candidate.seen.push_back(seen_.at(id));
  seen_.clear();
  seen_order_.clear();
  frames_since_keyframe_ = 0;
  map_version_ = map_version;
  return candidate;
}

KeyframeCandidate KeyframeProposer::make_submap(const TrackedFrame& frame, double reach_m,
                                                std::uint64_t map_version) {
  KeyframeCandidate candidate = make(frame, map_version);
  candidate.submap_reach_m = reach_m;
  return candidate;
}

}  // namespace ygslam
