// Something near that fills the view, or a floor that moves, carries the points along that were
// followed from the frame before. The map knows nothing of it, or has it only since a moment ago:
// what it predicts in view is asked, too, and where that gives another pose with more of its
// landmarks, that pose is the camera's.
#pragma once

#include <optional>
#include <span>

#include "motion/classification/point_labels.hpp"
#include "tracking/pose_estimator.hpp"

namespace ygslam {

class MapRival {
 public:
  /// @param estimator must outlive it.
  /// @param older_speak the landmarks that the map had before are asked by themselves, too; not in
  /// modes without geometry, where all of the map is static.
  MapRival(const PoseEstimator& estimator, bool older_speak)
      : estimator_(estimator), older_speak_(older_speak) {}

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
  struct Output {
    std::optional<PoseResult> pose{};  ///< nullopt: the pose that was followed stands
    bool contested = false;  ///< two motions that both explain much: neither is to be believed
  };
  /// A pose that rests on few points is contested, too.
  [[nodiscard]] Output step(const Input& in) const;

 private:
  [[nodiscard]] std::optional<PoseResult> by_all(const Input& in) const;
  [[nodiscard]] Output by_older_landmarks(const Input& in) const;

  const PoseEstimator& estimator_;
  bool older_speak_;
};

}  // namespace ygslam
