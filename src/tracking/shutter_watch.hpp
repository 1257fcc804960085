// The shutter's times as tracking uses them: what the camera's file says, until the pictures tell
// otherwise of a camera nobody knows.
#pragma once

#include <optional>

#include "tracking/camera_estimator.hpp"

namespace ygslam {

/// A read-out time that was found to differ from the one in use.
struct ShutterReport {
  double readout_s = 0;  ///< of colour and depth, taken as equal
  double std_s = 0;
  double in_use_s = 0;
  bool taken_over = false;  ///< false: the camera's file is believed
};

/// What a frame's pose becomes where its read-out time is found after it was tracked, to first
/// order:
///   T_camera_world <- exp((readout_s - in_use_s) twist_per_s) T_camera_world
struct ReadoutSensitivity {
  double in_use_s = 0;
  Vec6 twist_per_s = Vec6::Zero();  ///< zero: does not depend on it, or not known
};

class ShutterWatch {
 public:
  explicit ShutterWatch(const Camera& camera);

  [[nodiscard]] const ShutterTimes& times() const { return times_; }
  /// It rolls, or nobody knows.
  [[nodiscard]] bool may_roll() const { return !known_ || !times_.is_global(); }

  /// @param frame one that was tracked. @return something where it is new to the user.
  [[nodiscard]] std::optional<ShutterReport> step(const TrackedFrame& frame,
                                                  const SE3& T_camera_world, const LocalView& view);
  /// Of the pose, while the times are not surely known. Landmarks count alike, with one pixel.
  [[nodiscard]] ReadoutSensitivity sensitivity(const TrackedFrame& frame, const SE3& T_camera_world,
                                               const LocalView& view) const;

 private:
  const Camera& camera_;
  CameraEstimator estimator_;
  ShutterTimes times_;
  const bool known_;
  bool reported_ = false;
  int parts_wanted_ = 6;  // half seconds
};

}  // namespace ygslam
