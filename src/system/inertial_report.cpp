#include "system/inertial_report.hpp"

#include <utility>

#include "core/counted.hpp"
#include "core/log.hpp"

namespace ygslam {

void InertialReport::imu_began(const Vec3& gravity_odom) {
  imu_was_told_of_ = true;
  if (std::exchange(imu_is_known_, true)) return;
  const Vec3 up = -gravity_odom.normalized();
  log::info("IMU: gravity and biases are known; up in odom is {:.3f} {:.3f} {:.3f}", up.x(), up.y(),
            up.z());
}

void InertialReport::imu_dropped(ImuFault fault) {
  imu_was_told_of_ = true;
  const std::size_t count = ++imu_faults_[fault];
  // The IMU is tried anew twice a second: not the second to the ninth time.
  if (!is_power_of_ten(count)) return;
  log::warn("IMU: {}: it is not used until that has changed{}", to_string(fault),
            count > 1 ? fmt::format(" ({} times so far)", count) : "");
  imu_is_known_ = false;
}

void InertialReport::wheels_agree(const WheelOdometry& wheels) {
  if (std::exchange(wheels_agree_, true)) return;
  log::info(
      "wheels: they agree with the camera, their way times {:.4f} and their turn times {:.4f}",
      1 + wheels.errors()[0], 1 + wheels.errors()[1]);
}

void InertialReport::wheels_dropped(WheelFault fault) {
  if (!wheel_faults_.insert(fault).second) return;
  log::warn("wheels: {}: they are not used until that has changed", to_string(fault));
  wheels_agree_ = false;
}

void InertialReport::finish_imu() {
  if (!frame_times_ || std::exchange(imu_was_told_of_, true)) return;
  if (!reading_times_) {
    log::warn("IMU: no reading came: it was not used");
  } else if (reading_times_->last < frame_times_->first ||
             frame_times_->last < reading_times_->first) {
    log::warn("IMU: {}: it was not used", to_string(ImuFault::kOtherTime));
  } else {
    log::info("IMU: a second of poses is needed before it is of use, which never came");
  }
}

void InertialReport::finish_wheels() {
  if (!frame_times_ || wheels_came_ || !wheel_faults_.insert(WheelFault::kNoPoses).second) return;
  log::warn("wheels: no pose came: they were not used");
}

}  // namespace ygslam
