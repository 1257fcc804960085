// Finds the camera again after a loss: descriptors against keyframes, three points for a pose.
#pragma once

#include <optional>

#include "core/rng.hpp"
#include "tracking/pose_estimator.hpp"

namespace ygslam {

struct RelocalizerConfig {
  int keyframes_per_frame = 4;  ///< tried for one frame; the next frame goes on with the others
  int min_matches = 20;         ///< descriptor matches to try a pose
  int min_inliers = 35;         ///< agreeing points after refinement on the map
};

class Relocalizer {
 public:
  Relocalizer(const RelocalizerConfig& config, const Camera& camera,
              const PoseEstimator& pose_estimator);

  [[nodiscard]] std::optional<PoseResult> step(const FrameFeatures& frame, const LocalView& view,
                                               Rng& rng);

 private:
  [[nodiscard]] std::optional<PoseResult> try_keyframe(const FrameFeatures& frame,
                                                       const LocalView& view,
                                                       const ViewKeyframe& keyframe,
                                                       Rng& rng) const;
  RelocalizerConfig config_;
  const Camera& camera_;
  const PoseEstimator& pose_estimator_;
  KeyframeId reference_ = kNoKeyframe;  // of the last view
  std::size_t next_ = 0;
};

}  // namespace ygslam
