// How the camera has turned, by the gyroscope alone: the turn between any two frames.
#pragma once

#include <cstdint>
#include <optional>

#include "inertial/camera_turn.hpp"

namespace ygslam {

/// Of one frame: meaningful against others of the same series.
struct GyroTurn {
  std::uint32_t series = 0;
  Timestamp stamp;
  Mat3 R_camera_start = Mat3::Identity();  ///< `start` is the camera where the series began
  double variance_rad2 = 0;                ///< since then, of each axis, by noise
};

/// Adds up what the gyroscope measured from frame to frame.
class GyroTurnSum {
 public:
  /// What is measured next does not go on from where this ended.
  void restart() {
    const std::uint32_t ended = now_.series;
    now_ = GyroTurn();
    now_.series = ended + 1;
  }
  /// @param measured with the biases as known then, up to the frame at `stamp`.
  void add(Timestamp stamp, const Preintegration& measured, const SE3& T_camera_imu);
  [[nodiscard]] const GyroTurn& now() const { return now_; }

 private:
  std::optional<ImuBias> bias_;  // of all series: what it errs by is found later
  GyroTurn now_;
};

}  // namespace ygslam
