// When a frame becomes a keyframe.
#pragma once

#include "geometry/se3.hpp"

namespace ygslam {

struct KeyframePolicyConfig {
  int min_interval_frames = 2;
  int max_interval_frames = 10;     ///< where no keyframe was taken nearby
  double tracked_ratio = 0.75;      ///< of the reference keyframe's landmarks still tracked
  int min_close_tracked = 100;      ///< fewer tracked near points and ...
  int min_close_untracked = 70;     ///< ... more new ones than this: insert
  double close_depth_m = 3.5;       ///< depth is good up to here
  double min_translation_m = 0.02;  ///< where matches thin out, counts as having moved
  double min_rotation_rad = 0.02;
};

struct KeyframeEvidence {
  int frames_since_last = 0;
  int tracked_landmarks = 0;
  int reference_landmarks = 0;  ///< well-observed landmarks of the reference keyframe
  int close_tracked = 0;        ///< static features with near depth and a landmark
  int close_untracked = 0;      ///< the same without
  SE3 T_camera_nearest;         ///< from the keyframe in view that was taken nearest to here
  double nearest_age_s = 0;     ///< since that one was taken
  bool mapper_busy = false;
};

[[nodiscard]] bool wants_keyframe(const KeyframeEvidence& evidence,
                                  const KeyframePolicyConfig& config);

}  // namespace ygslam
