#include "system/inertial_stage.hpp"

#include <utility>

#include "core/log.hpp"
#include "system/pose_covariance.hpp"

namespace ygslam {
namespace {

// What a pose errs by that its points do not show: where the map is bent, for a second or two. As
// noise of single frames that is so much (docs/inertial.md).
constexpr double kLeastStd_m = 0.004;
constexpr double kLeastStd_rad = 0.0115;

VisualPose visual_pose(const TrackResult& result) {
  const double factor = result.state == TrackState::kWeak ? kWeakStdFactor : 1;
  // exp(xi) on the left of T_camera_world is, to first order, -xi of the camera in its own axes.
  Mat6 covariance = factor * factor * result.covariance.value_or(Mat6::Zero());
  covariance.diagonal().head<3>().array() += kLeastStd_m * kLeastStd_m;
  covariance.diagonal().tail<3>().array() += kLeastStd_rad * kLeastStd_rad;
  return {result.T_odom_camera, covariance};
}

}  // namespace

InertialStage::InertialStage(const std::optional<ImuCalibration>& imu) {
  if (imu)
    config_ = {.noise = imu->noise,
               .T_camera_imu = imu->T_camera_imu,
               .time_offset_s = imu->time_offset_s};
  reset();
}

void InertialStage::reset() {
  estimator_.reset();
  if (config_) estimator_.emplace(*config_);
  had_pose_ = started_ = false;
}

void InertialStage::add(const ImuSample& sample) {
  if (estimator_) estimator_->add(sample);
}

std::optional<InertialPrediction> InertialStage::predict(Timestamp stamp) const {
  return estimator_ ? estimator_->predict(stamp) : std::nullopt;
}

void InertialStage::take(Timestamp stamp, const TrackResult& result) {
  if (!estimator_) return;
  const bool has_pose = is_seen(result.state) && result.T_odom_camera.is_finite();
  const bool found_again = has_pose && !std::exchange(had_pose_, has_pose);
  if (!has_pose) {
    estimator_->add_frame(stamp, std::nullopt);
  } else if (found_again) {
    estimator_->add_frame_found_again(stamp, visual_pose(result));
  } else {
    estimator_->add_frame(stamp, visual_pose(result));
  }
  tell();
}

void InertialStage::tell() {
  const ImuFault fault = estimator_->take_fault();
  if (fault != ImuFault::kNone) {
    log::warn("IMU: {}: it is not used until that has changed", to_string(fault));
    started_ = false;
  }
  if (started_ || !estimator_->started()) return;
  started_ = true;
  const Vec3 up = -estimator_->gravity_odom()->normalized();
  log::info("IMU: gravity and biases are known; up in odom is {:.3f} {:.3f} {:.3f}", up.x(), up.y(),
            up.z());
}

}  // namespace ygslam
