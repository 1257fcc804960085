#include "io/imu_calibration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/log.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

namespace ygslam {
namespace {

struct ImuKey {
  std::string_view name, unit;
  double least, most;
  bool required;
};
// In the order of ImuValues.
constexpr std::array<ImuKey, 8> kImuKeys = {{
    {"rate_hz", "Hz", 1, 1e5, false},
    {"gyroscope_noise_density", "rad/s/sqrt(Hz)", 0, 1, true},
    {"gyroscope_random_walk", "rad/s^2/sqrt(Hz)", 0, 1, true},
    {"accelerometer_noise_density", "m/s^2/sqrt(Hz)", 0, 10, true},
    {"accelerometer_random_walk", "m/s^3/sqrt(Hz)", 0, 10, true},
    {"gyroscope_range", "rad/s, 0: unknown", 0, 1e4, false},
    {"accelerometer_range", "m/s^2, 0: unknown", 0, 1e5, false},
    {"time_offset_s", "s, stamp of the IMU minus that of the camera", -10, 10, false},
}};
constexpr std::size_t kTimeOffset = kImuKeys.size() - 1;
constexpr std::string_view kPoseKey = "T_camera_imu";
constexpr double kMostLever_m = 100;
constexpr std::size_t kLargestImuYaml_bytes = std::size_t{1} << 20;

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

Error yaml_fault(const std::string& name, int line, const std::string& what) {
  const std::string where = line > 0 ? name + ":" + std::to_string(line) : name;
  return {ErrorKind::kConfig, where + ": " + what};
}

std::string unknown_imu_key(std::string_view key) {
  std::vector<std::string_view> names = {kPoseKey};
  for (const ImuKey& known : kImuKeys) names.push_back(known.name);
  const std::string_view nearest = nearest_word(key, names);
  return "unknown key '" + printable(key) + "'" +
         (nearest.empty() ? std::string() : ", did you mean '" + std::string(nearest) + "'?");
}

/// `[x, y, z, qx, qy, qz, qw]`. @return what is wrong, empty if nothing.
std::string store_pose(std::string_view value, SE3& pose) {
  const auto words = words_of(value, ",[]");
  constexpr std::size_t kPoseNumbers = 7;
  std::array<double, kPoseNumbers> v{};
  if (words.size() != kPoseNumbers)
    return fmt::format("{} numbers, not 7: [x, y, z, qx, qy, qz, qw]", words.size());
  for (std::size_t i = 0; i < v.size(); ++i) {
    const auto number = parse_number(words[i]);
    if (!number) return "'" + printable(words[i]) + "' is not a finite number";
    v[i] = *number;
  }
  const Vec3 t(v[0], v[1], v[2]);
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (!(std::abs(q.norm() - 1) < kQuaternionTolerance))
    return fmt::format("quaternion of length {:.3g}, not 1", q.norm());
  if (!(t.cwiseAbs().maxCoeff() <= kMostLever_m))
    return "farther than 100 m from the camera (metres are expected)";
  pose = SE3(q, t);
  return {};
}

std::string store_number(const ImuKey& key, std::string_view word, double& place) {
  const auto number = parse_number(word);
  if (!number) return "'" + printable(word) + "' is not a finite number";
  if (*number < key.least || *number > key.most)
    return fmt::format("{} must lie in {:g} to {:g} ({}), is {:g}", key.name, key.least, key.most,
                       key.unit, *number);
  place = *number;
  return {};
}

}  // namespace

Result<ImuCalibration> parse_imu_calibration(std::string_view text, const std::string& name) {
  if (Status status = check_is_text(text, name); !status)
    return Error{ErrorKind::kConfig, status.error().message};
  ImuCalibration imu;
  double time_offset_s = 0;
  const auto values = values_of(imu, time_offset_s);
  std::array<bool, kImuKeys.size() + 1> seen{};  // the last is the pose
  for (const TextLine& line : data_lines(text)) {
    if (line.text == "---" || line.text == "%YAML:1.0") continue;
    const std::size_t colon = line.text.find(':');
    if (colon == std::string_view::npos)
      return yaml_fault(name, line.number, "a line 'key: value' is expected");
    const std::string_view key = trimmed(line.text.substr(0, colon));
    std::string_view value = line.text.substr(colon + 1);
    value = trimmed(value.substr(0, value.find('#')));
    const auto* known = std::find_if(kImuKeys.begin(), kImuKeys.end(),
                                     [&](const ImuKey& k) { return k.name == key; });
    const auto index = static_cast<std::size_t>(known - kImuKeys.begin());
    const bool is_pose = key == kPoseKey;
    if (known == kImuKeys.end() && !is_pose)
      return yaml_fault(name, line.number, unknown_imu_key(key));
    if (std::exchange(seen[index], true))
      return yaml_fault(name, line.number, "'" + std::string(key) + "' is given twice");
    const std::string fault =
        is_pose ? store_pose(value, imu.T_camera_imu) : store_number(*known, value, *values[index]);
    if (!fault.empty()) return yaml_fault(name, line.number, fault);
  }
  for (std::size_t i = 0; i < kImuKeys.size(); ++i)
    if (kImuKeys[i].required && !seen[i])
      return yaml_fault(name, 0, "'" + std::string(kImuKeys[i].name) + "' is missing");
  if (!seen.back()) return yaml_fault(name, 0, "'T_camera_imu' is missing");
  if (seen[kTimeOffset]) imu.time_offset_s = time_offset_s;
  return imu;
}

Result<ImuCalibration> read_imu_calibration(const std::filesystem::path& path) {
  const Result<std::string> text = read_file(path, kLargestImuYaml_bytes);
  if (!text.ok()) return text.error();
  return parse_imu_calibration(*text, path.string());
}

std::string format_imu_calibration(const ImuCalibration& imu, std::string_view comment) {
  std::string out = fmt::format("# {}\n", comment);
  const double time_offset_s = imu.time_offset_s.value_or(0);
  const auto values = values_of(imu, time_offset_s);
  for (std::size_t i = 0; i < kImuKeys.size(); ++i)
    if (i != kTimeOffset || imu.time_offset_s)
      out += fmt::format("{}: {}  # [{}]\n", kImuKeys[i].name, *values[i], kImuKeys[i].unit);
  const Vec3& t = imu.T_camera_imu.t();
  const Eigen::Quaterniond q = imu.T_camera_imu.quaternion();
  out += fmt::format(
      "{}: [{}, {}, {}, {}, {}, {}, {}]  # x y z [m] qx qy qz qw, of the IMU in the "
      "camera's optical frame\n",
      kPoseKey, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  return out;
}

}  // namespace ygslam
