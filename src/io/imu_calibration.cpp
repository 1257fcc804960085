#include "io/imu_calibration.hpp"

#include <array>

#include "core/log.hpp"
#include "io/sensor_yaml.hpp"

namespace ygslam {
namespace {

constexpr double kLeastDensity =
    1e-9;  // below any sensor's: its readings, or its biases, would be the truth
// In the order of values_of().
constexpr std::array<SensorKey, 8> kImuKeys = {{
    {"rate_hz", "Hz", 1, 1e5, false},
    {"gyroscope_noise_density", "rad/s/sqrt(Hz)", kLeastDensity, 1, true},
    {"gyroscope_random_walk", "rad/s^2/sqrt(Hz)", kLeastDensity, 1, true},
    {"accelerometer_noise_density", "m/s^2/sqrt(Hz)", kLeastDensity, 10, true},
    {"accelerometer_random_walk", "m/s^3/sqrt(Hz)", kLeastDensity, 10, true},
    {"gyroscope_range", "rad/s, 0: unknown", 0, 1e4, false},
    {"accelerometer_range", "m/s^2, 0: unknown", 0, 1e5, false},
    {"time_offset_s", "s, stamp of the IMU minus that of the camera", -10, 10, false},
}};
constexpr std::size_t kRate = 0, kTimeOffset = kImuKeys.size() - 1;
constexpr std::string_view kPoseKey = "T_camera_imu";

template <typename Imu, typename Value>
auto values_of(Imu& imu, Value& time_offset_s) {
  return std::array{&imu.noise.rate_hz,
                    &imu.noise.gyro_noise_radps_sqrthz,
                    &imu.noise.gyro_walk_radps2_sqrthz,
                    &imu.noise.accel_noise_mps2_sqrthz,
                    &imu.noise.accel_walk_mps3_sqrthz,
                    &imu.gyro_range_radps,
                    &imu.accel_range_mps2,
                    &time_offset_s};
}

}  // namespace

Result<ImuCalibration> parse_imu_calibration(std::string_view text, const std::string& name) {
  ImuCalibration imu;
  double time_offset_s = 0;
  const auto values = values_of(imu, time_offset_s);
  const auto seen = parse_sensor_yaml(text, name, {kPoseKey, &imu.T_camera_imu, kImuKeys, values});
  if (!seen.ok()) return seen.error();
  if ((*seen)[kTimeOffset]) imu.time_offset_s = time_offset_s;
  imu.rate_is_said = (*seen)[kRate];
  return imu;
}

Result<ImuCalibration> read_imu_calibration(const std::filesystem::path& path) {
  const Result<std::string> text = read_sensor_yaml(path.string());
  if (!text.ok()) return text.error();
  return parse_imu_calibration(*text, path.string());
}

std::string format_imu_calibration(const ImuCalibration& imu, std::string_view comment) {
  std::string out = fmt::format("# {}\n", comment);
  const double time_offset_s = imu.time_offset_s.value_or(0);
  const auto values = values_of(imu, time_offset_s);
  for (std::size_t i = 0; i < kImuKeys.size(); ++i)
    if (i != kTimeOffset || imu.time_offset_s) out += format_sensor_number(kImuKeys[i], *values[i]);
  return out +
         format_sensor_pose(kPoseKey, imu.T_camera_imu, "of the IMU in the camera's optical frame");
}

}  // namespace ygslam
