// The shutter's times as tracking uses them: what the camera's file says, until the pictures tell
// otherwise of a camera nobody knows.
#pragma once

#include <optional>
#include <utility>

#include "tracking/camera_estimator.hpp"

namespace ygslam {

/// A read-out time that was found to differ from the one in use.
struct ShutterReport {
  double readout_s = 0;  ///< of colour and depth, taken as equal
  double std_s = 0;
  double in_use_s = 0;
  bool taken_over = false;  ///< false: the camera's file is believed
  ShutterTimes times;       ///< in use from now on
};

class ShutterWatch {
 public:
  /// @param camera must outlive it.
  explicit ShutterWatch(const Camera& camera);

  [[nodiscard]] const ShutterTimes& times() const { return times_; }
  /// Told by the camera's file, not found.
  [[nodiscard]] bool known() const { return known_; }
  /// It rolls, or nobody knows.
  [[nodiscard]] bool may_roll() const { return !known_ || !times_.is_global(); }

  /// By the times in use, see shutter_corrected().
  [[nodiscard]] FrameFeatures corrected(FrameFeatures seen, const Vec6& body_velocity) const {
    return shutter_corrected(std::move(seen), camera_, times_, body_velocity);
  }

  /// @param frame one that was tracked. @return something where it is new to the user.
  [[nodiscard]] std::optional<ShutterReport> step(const TrackedFrame& frame);

 private:
  [[nodiscard]] ShutterTimes times_with(double readout_s) const;

  const Camera& camera_;
  CameraEstimator estimator_;
  ShutterTimes times_;
  ShutterTimes suspected_;  // of the device that it may be
  bool known_;
  bool reported_ = false;
  int parts_wanted_ = 6;  // half seconds
};

}  // namespace ygslam
