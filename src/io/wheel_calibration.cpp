#include "io/wheel_calibration.hpp"

#include <array>

#include "core/log.hpp"
#include "io/sensor_yaml.hpp"

namespace ygslam {
namespace {

// In the order of wheel_values().
constexpr std::array<SensorKey, 5> kWheelKeys = {{
    {"way_scale", "true way for a told one", 0.5, 2, false},
    {"turn_scale", "true turn for a told one", 0.5, 2, false},
    {"way_noise", "m/sqrt(m)", 1e-5, 1, false},
    {"turn_noise", "rad/sqrt(m), and for each root of a radian", 1e-5, 1, false},
    {"time_offset_s", "s, stamp of the wheels minus that of the camera", -10, 10, false},
}};
constexpr std::string_view kWheelPose = "T_base_camera";

template <typename Wheels>
auto wheel_values(Wheels& wheels) {
  return std::array{&wheels.way_scale, &wheels.turn_scale, &wheels.way_noise, &wheels.turn_noise,
                    &wheels.time_offset_s};
}

}  // namespace

Result<WheelCalibration> parse_wheel_calibration(std::string_view text, const std::string& name) {
  WheelCalibration wheels;
  const auto values = wheel_values(wheels);
  const auto seen =
      parse_sensor_yaml(text, name, {kWheelPose, &wheels.T_base_camera, kWheelKeys, values});
  if (!seen.ok()) return seen.error();
  return wheels;
}

Result<WheelCalibration> read_wheel_calibration(const std::filesystem::path& path) {
  const Result<std::string> text = read_sensor_yaml(path.string());
  if (!text.ok()) return text.error();
  return parse_wheel_calibration(*text, path.string());
}

std::string format_wheel_calibration(const WheelCalibration& wheels, std::string_view comment) {
  std::string out = fmt::format("# {}\n", comment);
  const auto values = wheel_values(wheels);
  for (std::size_t i = 0; i < kWheelKeys.size(); ++i)
    out += format_sensor_number(kWheelKeys[i], *values[i]);
  return out + format_sensor_pose(kWheelPose, wheels.T_base_camera,
                                  "of the camera's optical frame in the base (x ahead, z up)");
}

}  // namespace ygslam
