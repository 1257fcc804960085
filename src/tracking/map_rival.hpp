// Something near that fills the view carries the points along that were followed from the frame
// before. The map knows nothing of it: what it predicts in view is asked, too, and where that gives
// another pose with more of its landmarks, that pose is the camera's.
#pragma once

#include <optional>
#include <span>

#include "motion/classification/point_labels.hpp"
#include "tracking/pose_estimator.hpp"

namespace ygslam {

class MapRival {
 public:
  /// @param estimator must outlive it.
  explicit MapRival(const PoseEstimator& estimator) : estimator_(estimator) {}

  struct Input {
    const std::optional<PoseResult>& followed;  ///< nullopt: none was found
    const FrameFeatures& seen;
    std::span<const PointEvidence> evidence;  ///< of its features
    const LocalView& view;
    SE3 T_guess_world;  ///< T_camera_world as predicted
  };

  /// Few points agree with the pose that was followed, or none was found.
  [[nodiscard]] static bool is_wanted(const std::optional<PoseResult>& followed,
                                      const LocalView& view);
  /// @return nullopt: the pose that was followed stands. One that rests on few points is contested.
  [[nodiscard]] std::optional<PoseResult> step(const Input& in) const;

 private:
  const PoseEstimator& estimator_;
};

}  // namespace ygslam
