// Inertial and wheel odometry beside tracking: asked before a frame is looked at, told what became
// of it.
#pragma once

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "inertial/inertial_estimator.hpp"
#include "inertial/turn_filter.hpp"
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
  /// No frames come any more: of an IMU of which nothing was told it tells why it was of no use.
  void finish();

 private:
  [[nodiscard]] std::optional<CameraTurn> turn_to(Timestamp stamp, TrackState state);
  void hold(TrackResult& result, const std::optional<CameraTurn>& turn, double step_s);
  void tell_imu(Timestamp stamp, TrackResult& result);
  void tell_gravity(KeyframeCandidate& candidate);
  void overrule(Timestamp stamp, const TrackResult& result, bool found_again);
  void tell_wheels();

  std::optional<InertialConfig> config_;
  std::optional<WheelCalibration> wheel_config_;
  std::optional<WheelOdometry> wheels_;  // the estimator refers to it
  std::optional<InertialEstimator> estimator_;
  TurnFilter held_;
  std::optional<Timestamp> posed_;           // the last frame with a pose, coasting too
  bool had_pose_ = false;                    // in the last frame
  bool overrules_ = false;                   // vision, since it had a pose
  std::optional<Timestamp> believed_since_;  // the IMU; told
  bool imu_was_told_of_ = false;
  struct Span {  // of stamps
    Timestamp first, last;
    void add(Timestamp stamp) { first = std::min(first, stamp), last = std::max(last, stamp); }
  };
  std::optional<Span> reading_times_, frame_times_;
  bool wheels_agree_ = false;              // told
  std::optional<Timestamp> gravity_told_;  // of the last keyframe that it was told of
  std::set<WheelFault> wheels_told_;
  std::map<ImuFault, std::size_t> imu_faults_;  // how often each
};

}  // namespace ygslam
