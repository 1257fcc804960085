#include "tracking/keyframe_policy.hpp"

namespace ygslam {

bool wants_keyframe(const KeyframeEvidence& e, const KeyframePolicyConfig& config) {
  if (e.frames_since_last < config.min_interval_frames) return false;
  const bool starving =
      e.close_tracked < config.min_close_tracked && e.close_untracked > config.min_close_untracked;
  const bool thinning = e.tracked_landmarks < config.tracked_ratio * e.reference_landmarks;
  const bool moved = e.T_camera_nearest.t().norm() > config.min_translation_m ||
                     e.T_camera_nearest.angle() > config.min_rotation_rad;
  const bool due = e.frames_since_last >= config.max_interval_frames && moved;
  // A busy mapper gets only what tracking cannot do without.
  if (e.mapper_busy) return starving && e.frames_since_last >= 2 * config.min_interval_frames;
  return starving || ((thinning || due) && moved);
}

}  // namespace ygslam
