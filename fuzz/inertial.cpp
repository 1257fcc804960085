#include <cmath>

#include "bag/bag_imu.hpp"
#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/imu_calibration.hpp"
#include "io/imu_file.hpp"
#include "io/wheel_calibration.hpp"

namespace ygslam::fuzz {
namespace {

/// The same bytes as messages of a bag.
void messages_of_imu(std::string_view bytes) {
  const std::span<const std::uint8_t> content(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                              bytes.size());
  for (const Layout layout : {Layout::kCdr, Layout::kRos1}) {
    ImuReader reader;
    for (int i = 0; i < 2; ++i)
      reader.take({"/t", "sensor_msgs/Imu", layout}, {0, {5}, content, {}});
    const auto samples = chosen_readings(reader.sources(), "", "--imu-topic");
    if (!samples.ok()) continue;
    for (const ImuSample& sample : samples->samples)
      CHECK(sample.angular_velocity_radps.allFinite() && sample.specific_force_mps2.allFinite());
  }
}

}  // namespace

/// Readings of an IMU as text and as messages, of an accelerometer alone, imu.yaml and odom.yaml.
void inertial(std::string_view bytes) {
  messages_of_imu(bytes);
  if (const auto samples = parse_imu(bytes, "imu.csv"); samples.ok()) {
    CHECK(!samples->empty());
    for (std::size_t i = 0; i < samples->size(); ++i) {
      const ImuSample& sample = (*samples)[i];
      CHECK(sample.angular_velocity_radps.allFinite() && sample.specific_force_mps2.allFinite());
      CHECK(i == 0 || (*samples)[i - 1].stamp < sample.stamp);
    }
    const auto again = parse_imu(format_imu(*samples), "again.csv");
    CHECK(again.ok() && again->size() == samples->size());
    for (std::size_t i = 0; i < samples->size(); ++i) {
      CHECK((*again)[i].stamp == (*samples)[i].stamp);
      CHECK((*again)[i].specific_force_mps2 == (*samples)[i].specific_force_mps2);
    }
  }
  if (const auto samples = parse_accelerometer(bytes, "accelerometer.txt"); samples.ok()) {
    CHECK(!samples->empty());
    for (std::size_t i = 1; i < samples->size(); ++i)
      CHECK((*samples)[i - 1].stamp < (*samples)[i].stamp);
  }
  if (const auto wheels = parse_wheel_calibration(bytes, "odom.yaml"); wheels.ok()) {
    CHECK(std::abs(wheels->T_base_camera.R().determinant() - 1) < 1e-3);
    CHECK(wheels->way_scale >= 0.5 && wheels->way_scale <= 2);
    CHECK(parse_wheel_calibration(format_wheel_calibration(*wheels, "again"), "again.yaml").ok());
  }
  if (const auto imu = parse_imu_calibration(bytes, "imu.yaml"); imu.ok()) {
    CHECK(imu->T_camera_imu.is_finite() && std::isfinite(imu->noise.gyro_noise_radps_sqrthz));
    CHECK(std::abs(imu->T_camera_imu.R().determinant() - 1) < 1e-3);
    CHECK(parse_imu_calibration(format_imu_calibration(*imu, "again"), "again.yaml").ok());
  }
}

}  // namespace ygslam::fuzz
