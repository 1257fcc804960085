// Inertial odometry beside tracking: asked before a frame is looked at, told what became of it.
#pragma once

#include <optional>

#include "inertial/inertial_estimator.hpp"
#include "tracking/track_result.hpp"

namespace ygslam {

class InertialStage {
 public:
  /// @param imu nullopt: there is none.
  explicit InertialStage(const std::optional<ImuCalibration>& imu);

  void add(const ImuSample& sample);
  /// Of the next frame.
  [[nodiscard]] std::optional<InertialPrediction> predict(Timestamp stamp) const;
  /// Every frame in turn.
  void take(Timestamp stamp, const TrackResult& result);
  void reset();

 private:
  void tell();

  std::optional<InertialConfig> config_;
  std::optional<InertialEstimator> estimator_;
  bool had_pose_ = false;  // in the last frame
  bool started_ = false;   // told
};

}  // namespace ygslam
