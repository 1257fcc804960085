// Inertial and wheel odometry beside tracking: asked before a frame is looked at, told what became
// of it.
#pragma once

#include <optional>

#include "inertial/inertial_estimator.hpp"
#include "system/held_pose.hpp"
#include "system/inertial_report.hpp"
#include "tracking/track_result.hpp"

namespace ygslam {

class InertialStage {
 public:
  InertialStage(const InertialStage&) = delete;
  InertialStage& operator=(const InertialStage&) = delete;
  InertialStage(InertialStage&&) = delete;
  InertialStage& operator=(InertialStage&&) = delete;
  ~InertialStage() = default;
  /// @param imu, wheels nullopt: there are none.
  InertialStage(const std::optional<ImuCalibration>& imu,
                const std::optional<WheelCalibration>& wheels);

  void add(const ImuSample& sample);
  void add(const OdometrySample& sample);
  /// Of the next frame.
  [[nodiscard]] std::optional<PosePrediction> predict(Timestamp stamp) const;
  /// Every frame in turn. Tells a keyframe candidate where gravity pulls, and takes that back where
  /// the IMU turned out to be wrong: since it was last begun with. Moves the pose that is told to
  /// where the gyroscope holds it; `result.pose` stays what the points say. @return how the camera
  /// turned since the last frame with a pose, where this one has one and a gyroscope knows.
  std::optional<CameraTurn> take(Timestamp stamp, TrackResult& result);
  void reset();
  /// No frames come any more: of a sensor of which nothing was told it tells why it was of no use.
  void finish() {
    if (estimator_) report_.finish_imu();
    if (wheels_) report_.finish_wheels();
  }

 private:
  void overrule(Timestamp stamp, const TrackResult& result, bool found_again);
  void follow_imu(Timestamp stamp, TrackResult& result);
  void follow_wheels();
  void tell_gravity(KeyframeCandidate& candidate);

  std::optional<InertialConfig> config_;
  std::optional<WheelCalibration> wheel_config_;
  std::optional<WheelOdometry> wheels_;  // the estimator refers to it
  std::optional<InertialEstimator> estimator_;
  std::optional<HeldPose> held_;  // with the estimator
  InertialReport report_;
  bool had_pose_ = false;                    // in the last frame
  Doubt last_doubt_;                         // of odom, at the last pose that was handed on
  bool overrules_ = false;                   // vision, since it had a pose
  std::optional<Timestamp> believed_since_;  // the IMU
  std::optional<Timestamp> gravity_told_;    // of the last keyframe that it was told of
};

}  // namespace ygslam
