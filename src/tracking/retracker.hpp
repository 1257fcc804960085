// Poses of the last seconds, found again without what has turned out not to be of the world.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "core/rng.hpp"
#include "image/pixel_mask.hpp"
#include "tracking/pose_estimator.hpp"
#include "tracking/tracked_frame.hpp"

namespace ygslam {

/// Where an earlier frame was, told by a keyframe that was not misled.
struct RetrackedFrame {
  FrameId frame = kNoFrame;
  KeyframeRelativePose pose;
};

/// Keeps what the last frames saw, and goes back over it once the map has forgotten what misled it:
/// each frame is matched with the one after it and with the map, a few frames with every new one.
class Retracker {
 public:
  Retracker(const PoseEstimator& estimator, int least_inliers)
      : estimator_(estimator), least_inliers_(least_inliers) {}

  /// Of each frame with a pose. @param mask that came to be known: null = nothing new.
  void add(const TrackedFrame& frame, const PixelMaskPtr& mask);
  /// @param is_sure the newest frame has a good pose. @return what was found.
  [[nodiscard]] std::vector<RetrackedFrame> step(const LocalView& view, bool is_sure, Rng& rng);

 private:
  struct Later {
    TrackedFrame frame;
    SE3 T_now_before;  ///< from the frame after it: the next is as far away
  };
  void begin();
  [[nodiscard]] std::optional<RetrackedFrame> go_back(const LocalView& view, Rng& rng);

  const PoseEstimator& estimator_;
  int least_inliers_;
  std::deque<TrackedFrame> frames_;   // without their images, oldest first
  PixelMaskPtr mask_;                 // what they are to be seen without
  double done_share_ = 0;             // of the image, of the largest mask so far
  int wait_ = 0;                      // frames, for the map
  std::deque<TrackedFrame> earlier_;  // still to be gone over
  std::optional<Later> later_;        // that was, last
};

}  // namespace ygslam
