#include "io/imu_calibration.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
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
// As Kalibr names them (its wiki, "Yaml formats"): p_cam = T_cam_imu p_imu, t_imu = t_cam + shift,
// so that both are ours.
constexpr std::string_view kKalibrPose = "T_cam_imu", kKalibrShift = "timeshift_cam_imu",
                           kKalibrRate = "update_rate";
constexpr std::size_t kFirstDensity = 1, kDensities = 4;  // of kImuKeys, with the same names

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

using KalibrValues = std::map<std::string, std::string, std::less<>>;

/// By the names of keys, whatever sensor they stand below. @return nullopt: none of Kalibr's.
std::optional<Result<KalibrValues>> kalibr_values(std::string_view text, const std::string& name) {
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::kConfig, name + ": " + what};
  };
  KalibrValues values;
  std::string fault;
  for (const auto& [key, value] : foreign_camera::flat_yaml(text).values) {
    if (key.starts_with("cam1."))
      fault = "tells of several cameras: keep the colour camera's lines";
    if (key.starts_with("imu1.")) fault = "tells of several IMUs: keep the lines of one";
    const std::string word = key.substr(key.rfind('.') + 1);
    const bool is_read = std::ranges::find(kImuKeys, word, &SensorKey::name) != kImuKeys.end() ||
                         word == kKalibrShift || word == kKalibrRate;
    const auto [known, is_new] = values.emplace(word, value);
    if (!is_new && is_read && known->second != value) fault = "has two values of " + word;
  }
  if (values.contains(kPoseKey)) return std::nullopt;
  if (!values.contains(kKalibrPose) && !values.contains(kKalibrRate)) return std::nullopt;
  const std::string& model = values["model"];
  if (!model.empty() && model != "calibrated")
    fault = "model: '" + printable(model) + "' is not read: only calibrated";
  return fault.empty() ? Result<KalibrValues>(std::move(values)) : refuse(fault);
}

/// Four rows of four numbers, from the line of the key to that of the next one.
/// @return nullopt where they are no rigid motion.
std::optional<SE3> kalibr_pose(std::string_view text) {
  std::vector<double> numbers;
  bool is_in_it = false;
  for (const TextLine& line : data_lines(text)) {
    std::string_view row = line.text.substr(0, line.text.find('#'));
    if (const std::size_t colon = row.find(':'); colon != std::string_view::npos) {
      is_in_it = trimmed(row.substr(0, colon)) == kKalibrPose;
      row = row.substr(colon + 1);
    }
    if (!is_in_it) continue;
    while (row.starts_with("- ")) row = trimmed(row.substr(2));
    for (const std::string_view word : words_of(row, ",[]"))
      numbers.push_back(parse_number(word).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  if (numbers.size() != 16) return std::nullopt;
  const auto T_camera_imu = rigid_motion(numbers);
  const bool is_near = T_camera_imu && (T_camera_imu->t().array().abs() <= kMostLever_m).all();
  return is_near ? T_camera_imu : std::nullopt;
}

/// Noise stays as usual where none is told. @return what is wrong, empty if nothing.
std::string store_kalibr_numbers(const KalibrValues& said, ImuCalibration& imu) {
  double time_offset_s = 0;
  const auto values = values_of(imu, time_offset_s);
  std::string fault;
  const auto store = [&](std::size_t i, std::string_view kalibrs_name) {
    SensorKey key = kImuKeys[i];
    key.name = kalibrs_name;
    const auto found = said.find(kalibrs_name);
    if (found == said.end()) return false;
    const std::string wrong = store_sensor_number(key, found->second, *values[i]);
    if (!wrong.empty()) fault = wrong;
    return true;
  };
  imu.rate_is_said = store(kRate, kKalibrRate);
  if (store(kTimeOffset, kKalibrShift)) imu.time_offset_s = time_offset_s;
  std::size_t densities = 0;
  for (std::size_t i = kFirstDensity; i < kFirstDensity + kDensities; ++i)
    densities += store(i, kImuKeys[i].name) ? 1 : 0;
  if (densities % kDensities != 0) fault = "has noise densities and random walks in part only";
  return fault;
}

/// Kalibr's imu.yaml and the camchain that it writes with an IMU, in one file; of the latter alone
/// noise is as usual. @return nullopt: it is none of these.
std::optional<Result<ImuCalibration>> parse_kalibr_imu(std::string_view text,
                                                       const std::string& name) {
  const auto said = kalibr_values(text, name);
  if (!said) return std::nullopt;
  if (!said->ok()) return said->error();
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::kConfig, name + ": " + what};
  };
  if (!said->value().contains(kKalibrPose))
    return refuse(
        "Kalibr's imu.yaml does not say where the IMU is: append the lines of the camchain that "
        "kalibr_calibrate_imu_camera writes (T_cam_imu)");
  ImuCalibration imu;
  if (const std::string fault = store_kalibr_numbers(said->value(), imu); !fault.empty())
    return refuse(fault);
  const auto T_camera_imu = kalibr_pose(text);
  if (!T_camera_imu)
    return refuse("T_cam_imu: four rows of a rigid motion in metres are expected, one camera's");
  imu.T_camera_imu = *T_camera_imu;
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
