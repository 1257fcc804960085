// What is fixed to the camera, and what follows from it: pixels that are not looked at, landmarks
// that the map must forget, earlier frames that are tracked again.
#pragma once

#include "tracking/ego_mask.hpp"
#include "tracking/retracker.hpp"

namespace ygslam {

class EgoMaskWatch {
 public:
  /// @param estimator must outlive it. @param least_inliers of a frame that is tracked again.
  EgoMaskWatch(const EgoMaskConfig& config, const CameraConfig& camera,
               const PoseEstimator& estimator, int least_inliers)
      : mask_(config, camera), retracker_(estimator, least_inliers) {}

  /// Each frame before it is tracked. @return pixels().
  const PixelMaskPtr& look(const RgbdFrame& frame);
  /// Those that are not looked at; null = none.
  [[nodiscard]] const PixelMaskPtr& pixels() const { return mask_.pixels(); }

  struct Input {
    Timestamp stamp;
    const TrackedFrame* tracked;  ///< null: without a pose
    const LocalView& view;
    bool is_sure;  ///< the pose is a good one
  };
  struct Output {
    PixelMaskPtr found, pixels;  ///< by itself, and all; null = none
    bool grew = false;           ///< the map may hold landmarks that are not of the world
    std::vector<RetrackedFrame> retracked;
  };
  /// The same frame once it was tracked.
  [[nodiscard]] Output step(const Input& in, Rng& rng);

 private:
  EgoMask mask_;
  Retracker retracker_;
};

}  // namespace ygslam
