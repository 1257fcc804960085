#include "io/imu_calibration.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "io/foreign_camera.hpp"
#include "io/sensor_yaml.hpp"
#include "io/text.hpp"
#include "io/trajectory_checks.hpp"

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
constexpr std::size_t kFirstDensity = 1, kDensities = 4;  // of kImuKeys

// As Kalibr names them (its wiki, "Yaml formats"): p_cam = T_cam_imu p_imu, t_imu = t_cam + shift,
// so that both are ours. Densities and random walks have the same names.
constexpr std::string_view kKalibrPose = "T_cam_imu", kKalibrShift = "timeshift_cam_imu",
                           kKalibrRate = "update_rate";
// Of an IMU beside the first one, which T_cam_imu is of: where, and when, it is as seen from there.
constexpr std::string_view kKalibrFromFirst = "T_i_b", kKalibrLate = "time_offset";
constexpr std::string_view kKalibrModel = "model";
constexpr std::array<std::string_view, 13> kUnusedOfKalibr = {
    "accelerometers",    "gyroscopes",       "T_cn_cnm1",  "cam_overlaps", "camera_model",
    "distortion_coeffs", "distortion_model", "intrinsics", "resolution",   "rostopic",
    kKalibrFromFirst,    kKalibrLate,        kKalibrModel};

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

/// A line of Kalibr's, or one of ours beside them.
struct SaidKey {
  std::string key, value;
};
using SaidKeys = std::array<std::optional<SaidKey>, kImuKeys.size()>;

std::optional<std::size_t> index_of(std::string_view key) {
  if (key == kKalibrRate) return kRate;
  if (key == kKalibrShift) return kTimeOffset;
  const auto found = std::ranges::find(kImuKeys, key, &SensorKey::name);
  if (found == kImuKeys.end()) return std::nullopt;
  return static_cast<std::size_t>(found - kImuKeys.begin());
}

/// "T_cam_imu" of "cam0.T_cam_imu".
std::string last_part(const std::string& key) { return key.substr(key.rfind('.') + 1); }

/// Of which there may be one: cam0, or cam1 alone.
bool are_several(const foreign_camera::FlatYaml& yaml, std::string_view kind) {
  std::set<std::string> groups;
  for (const auto& [key, value] : yaml.values) {
    const std::size_t dot = key.find('.');
    if (dot == std::string::npos || !key.starts_with(kind)) continue;
    const std::string number = key.substr(kind.size(), dot - kind.size());
    if (!number.empty() && number.find_first_not_of("0123456789") == std::string::npos)
      groups.insert(number);
  }
  return groups.size() > 1;
}

/// Kalibr writes more keys than those that are read.
/// @return what is wrong with one that is not read, empty if nothing.
std::string misspelt(const std::string& key) {
  std::vector<std::string_view> names(kUnusedOfKalibr.begin(), kUnusedOfKalibr.end());
  const std::size_t unused = names.size();
  names.insert(names.end(), {kKalibrPose, kKalibrShift, kKalibrRate});
  for (const SensorKey& known : kImuKeys) names.push_back(known.name);
  const auto nearest = std::ranges::find(names, nearest_word(key, names));
  const auto at = static_cast<std::size_t>(nearest - names.begin());
  if (at < unused || at == names.size() || key == *nearest) return {};
  return fmt::format("unknown key '{}', did you mean '{}'?", printable(key), *nearest);
}

/// By the names of keys, whatever sensor they stand below. @return what is wrong, empty if nothing.
std::string collect(const foreign_camera::FlatYaml& yaml, SaidKeys& said) {
  if (!yaml.contradicted.empty())
    return "two values of " + printable(last_part(*yaml.contradicted.begin()));
  if (are_several(yaml, "cam")) return "tells of several cameras: keep the colour camera's lines";
  if (are_several(yaml, "imu")) return "tells of several IMUs: keep the lines of one";
  for (const auto& [path, value] : yaml.values) {
    const std::string key = last_part(path);
    if (key == kKalibrModel && !value.empty() && value != "calibrated")
      return "model: '" + printable(value) + "' is not read: only calibrated";
    if (key == kKalibrLate && parse_number(value) != 0.0)
      return "time_offset: is of an IMU beside the one that T_cam_imu is of, which is not read";
    const auto index = index_of(key);
    if (!index) {
      if (std::string fault = misspelt(key); !fault.empty()) return fault;
      continue;
    }
    auto& known = said[*index];
    if (known && known->value != value)
      return known->key == key ? "two values of " + key : known->key + " and " + key + " differ";
    known = {key, value};
  }
  return {};
}

/// Four rows of four numbers, from the line of the key to that of the next one.
/// @return nullopt where they are no rigid motion.
std::optional<SE3> kalibr_pose(std::string_view text, std::string_view key) {
  std::vector<double> numbers;
  bool is_in_it = false;
  for (const TextLine& line : data_lines(text)) {
    std::string_view row = line.text.substr(0, line.text.find('#'));
    if (const std::size_t colon = row.find(':'); colon != std::string_view::npos) {
      is_in_it = trimmed(row.substr(0, colon)) == key;
      row = row.substr(colon + 1);
    }
    if (!is_in_it) continue;
    while (row.starts_with("- ")) row = trimmed(row.substr(2));
    for (const std::string_view word : words_of(row, ",[]"))
      numbers.push_back(parse_number(word).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  if (numbers.size() != 16) return std::nullopt;
  const auto pose = rigid_motion(numbers);
  return pose && (pose->t().array().abs() <= kMostLever_m).all() ? pose : std::nullopt;
}

/// Noise stays as usual where none is told. @return what is wrong, empty if nothing.
std::string store_kalibr_numbers(const SaidKeys& said, ImuCalibration& imu) {
  double time_offset_s = 0;
  const auto values = values_of(imu, time_offset_s);
  for (std::size_t i = 0; i < said.size(); ++i) {
    if (!said[i]) continue;
    SensorKey key = kImuKeys[i];
    key.name = said[i]->key;
    if (std::string wrong = store_sensor_number(key, said[i]->value, *values[i]); !wrong.empty())
      return wrong;
  }
  imu.rate_is_said = said[kRate].has_value();
  if (said[kTimeOffset]) imu.time_offset_s = time_offset_s;
  const auto densities = std::span(said).subspan<kFirstDensity, kDensities>();
  const auto is_missing = [](const std::optional<SaidKey>& key) { return !key; };
  const auto missing = std::ranges::find_if(densities, is_missing);
  if (missing == densities.end() || std::ranges::all_of(densities, is_missing)) return {};
  const auto at = static_cast<std::size_t>(missing - densities.begin());
  return fmt::format("'{}' is missing: noise densities and random walks are there in part only",
                     kImuKeys[kFirstDensity + at].name);
}

/// @return what is wrong, empty if nothing.
std::string store_kalibr_pose(const foreign_camera::FlatYaml& yaml, std::string_view text,
                              ImuCalibration& imu) {
  const auto says = [&](std::string_view name) {
    return std::ranges::any_of(yaml.values,
                               [&](const auto& entry) { return last_part(entry.first) == name; });
  };
  if (!says(kKalibrPose))
    return "Kalibr's imu.yaml does not say where the IMU is: append the lines of the camchain that "
           "kalibr_calibrate_imu_camera writes (T_cam_imu)";
  const auto T_camera_imu = kalibr_pose(text, kKalibrPose);
  if (!T_camera_imu)
    return "T_cam_imu: four rows of a rigid motion in metres are expected, one camera's";
  constexpr double kNone = 1e-9;  // [m], [rad]
  const auto T_imu_first = says(kKalibrFromFirst) ? kalibr_pose(text, kKalibrFromFirst) : SE3();
  if (!T_imu_first || !(T_imu_first->log().norm() < kNone))
    return "T_i_b: is of an IMU beside the one that T_cam_imu is of, which is not read";
  imu.T_camera_imu = *T_camera_imu;
  return {};
}

/// Kalibr's imu.yaml and the camchain that it writes with an IMU, in one file; of the latter alone
/// noise is as usual. @return nullopt: it is none of these.
std::optional<Result<ImuCalibration>> parse_kalibr_imu(std::string_view text,
                                                       const std::string& name) {
  const foreign_camera::FlatYaml yaml = foreign_camera::flat_yaml(text);
  bool is_kalibrs = false;
  for (const auto& [key, value] : yaml.values) {
    const std::string last = last_part(key);
    if (last == kPoseKey) return std::nullopt;
    is_kalibrs = is_kalibrs || last == kKalibrPose || last == kKalibrRate;
  }
  if (!is_kalibrs) return std::nullopt;
  ImuCalibration imu;
  SaidKeys said;
  std::string fault = collect(yaml, said);
  if (fault.empty()) fault = store_kalibr_numbers(said, imu);
  if (fault.empty()) fault = store_kalibr_pose(yaml, text, imu);
  if (!fault.empty()) return Error{ErrorKind::kConfig, name + ": " + fault};
  return imu;
}

}  // namespace

Result<ImuCalibration> parse_imu_calibration(std::string_view text, const std::string& name) {
  ImuCalibration imu;
  double time_offset_s = 0;
  const auto values = values_of(imu, time_offset_s);
  if (auto kalibr = parse_kalibr_imu(text, name)) return *std::move(kalibr);
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
