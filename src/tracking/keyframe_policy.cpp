#include "tracking/keyframe_policy.hpp"

#include <cmath>

#include "map/known_ground.hpp"

namespace ygslam {
namespace {

// On known ground another keyframe would show the same. A part of the features is found nowhere
// again, so that what has no landmark yet does not tell new ground from known. While a place is
// being looked at it does: people step aside, and a place that is new needs several views to be
// known again. Once in so many intervals it may do so all the same: what hid the ground may have
// gone.
constexpr int kLookAgain = 3;

bool has_moved(const KeyframeEvidence& e, double translation_m, double rotation_rad) {
  return e.T_camera_nearest.t().norm() > translation_m || e.T_camera_nearest.angle() > rotation_rad;
}

}  // namespace

bool wants_keyframe(const KeyframeEvidence& e, const KeyframePolicyConfig& config) {
  if (e.frames_since_last < config.min_interval_frames) return false;
  // What is known is not found any more: something has changed.
  const bool thinning = e.tracked_landmarks < config.tracked_ratio * e.reference_landmarks;
  const bool is_new = std::abs(e.nearest_age_s) < KnownGround::kVisit_s ||
                      has_moved(e, KnownGround::kNear_m, KnownGround::kNear_rad);
  const bool may_help =
      is_new || thinning || e.frames_since_last >= kLookAgain * config.max_interval_frames;
  const bool starving = e.close_tracked < config.min_close_tracked &&
                        e.close_untracked > config.min_close_untracked && may_help;
  const bool moved = has_moved(e, config.min_translation_m, config.min_rotation_rad);
  const bool due = e.frames_since_last >= config.max_interval_frames && is_new;
  // A busy mapper gets only what tracking cannot do without.
  if (e.mapper_busy) return starving && e.frames_since_last >= 2 * config.min_interval_frames;
  return starving || ((thinning || due) && moved);
}

}  // namespace ygslam
