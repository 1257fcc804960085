// The pose that is told of a frame, where the gyroscope holds it (inertial/turn_filter.hpp).
#pragma once

#include <optional>

#include "inertial/inertial_estimator.hpp"
#include "inertial/turn_filter.hpp"
#include "tracking/track_result.hpp"

namespace ygslam {

class HeldPose {
 public:
  explicit HeldPose(const SE3& T_camera_imu) : R_camera_imu_(T_camera_imu.R()) {}

  /// Every frame in turn, once the estimator knows of it. Moves the pose that is told;
  /// `result.pose` stays what the points say.
  /// @return how the camera turned since the last frame with a pose, where this one has one and the
  /// gyroscope knows.
  std::optional<CameraTurn> take(Timestamp stamp, const InertialEstimator& imu,
                                 TrackResult& result);

 private:
  /// By the gyroscope without its bias; nullopt before that is known.
  [[nodiscard]] std::optional<HeldTurn> held_turn(const CameraTurn& turn, double step_s,
                                                  const InertialEstimator& imu) const;

  Mat3 R_camera_imu_;
  TurnFilter filter_;
  std::optional<Timestamp> posed_;  // the last frame with a pose, coasting too
};

}  // namespace ygslam
