#include "facade/settings.hpp"

#include <cmath>
#include <limits>

#include "core/standard_error_sink.hpp"
#include "facade/convert.hpp"
#include "io/calibration.hpp"
#include "io/camera_devices.hpp"
#include "io/ignored_pixels.hpp"
#include "io/imu_calibration.hpp"
#include "io/wheel_calibration.hpp"

namespace ygslam::api {
namespace {

Vec3 vec3_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

bool is_floor(const Floor& floor) {
  const double length = vec3_of(floor.up_world).stableNorm();
  return is_finite(floor.up_world) && length >= 1e-6 && length <= 1e6 &&
         std::abs(floor.floor_m) < 1e4;
}

/// As a folder's camera that may be that of a known device.
void suspect_device(const CameraModel& m, CameraConfig& c) {
  if (m.likely_device.empty()) return;
  CameraConfig known;
  if (const auto fault = apply_device(m.likely_device, known))
    fail({ErrorKind::kConfig, "camera: likely_device: " + fault->reason});
  if (!c.shutter_known && shutter_times(c).is_global())
    suspect(*find_camera_device(m.likely_device), c);
}

bool has_masks(const SessionOptions& options) {
  if (options.segmenter == SegmenterKind::kModel) return !options.model.empty();
  return options.segmenter != SegmenterKind::kNone;
}

}  // namespace

// The faults of the settings, all at once.
SessionOptions session_options(const Settings& settings) {
  SessionOptions options;
  ConfigFaults faults;
  if (settings.segmenter == "frames") {
    options.segmenter = SegmenterKind::kGiven;
    options.given = std::make_shared<GivenMasks>();
  } else {
    faults.add(choose_segmenter(settings.segmenter, settings.model, options,
                                "model, builtin, none, masks:DIR or frames"));
  }
  SlamConfig& config = options.config;
  config.dynamic.mode = has_masks(options) ? DynamicMode::kFull : DynamicMode::kGeometry;
  ConfigSchema schema = schema_of(config);
  for (const auto& [key, value] : settings.options) faults.add(schema.set(key, value, "options"));
  if (!settings.dynamic.empty())
    faults.add(schema.set("dynamic.mode", settings.dynamic, "dynamic"));
  faults.add(validate(config));
  if (!(settings.room_every_s >= 0 && settings.room_every_s < 1e9))
    faults.add("room_every_s: 0 or more seconds are expected");
  if (settings.floor && !is_floor(*settings.floor))
    faults.add("floor: a direction, of a length between 1e-6 and 1e6, and a height are expected");
  if (const Status status = faults.status(); !status.ok()) fail(status.error());
  auto settled = resolved(std::move(config));
  if (!settled.ok()) fail(settled.error());
  options.config = std::move(settled).value();
  options.load_map = settings.load_map;
  options.localize_only = settings.localize_only;
  options.deterministic = settings.deterministic;
  options.config.run.keep_trajectory = settings.keep_trajectory;
  options.config.dense.keeps_plan = true;
  return options;
}

Imu Imu::read(const std::string& path) {
  const auto read = read_imu_calibration(path);
  if (!read.ok()) fail(read.error());
  const ImuNoise& noise = read->noise;
  return {to_api(read->T_camera_imu),
          noise.rate_hz,
          noise.gyro_noise_radps_sqrthz,
          noise.accel_noise_mps2_sqrthz,
          noise.gyro_walk_radps2_sqrthz,
          noise.accel_walk_mps3_sqrthz,
          read->time_offset_s};
}

ImuCalibration to_calibration(const Imu& imu) {
  const auto is_density = [](double density, double most) { return density > 0 && density < most; };
  ConfigFaults faults;
  if (!is_pose(imu.T_camera_imu))
    faults.add("imu.T_camera_imu: finite numbers and a unit quaternion are expected");
  if (!(imu.rate_hz >= 1 && imu.rate_hz <= 1e5)) faults.add("imu.rate_hz: 1 to 100000 is expected");
  if (!is_density(imu.gyro_noise_radps_sqrthz, 1) || !is_density(imu.accel_noise_mps2_sqrthz, 10) ||
      !is_density(imu.gyro_walk_radps2_sqrthz, 1) || !is_density(imu.accel_walk_mps3_sqrthz, 10))
    faults.add("imu: densities of noise above 0 and below 1 (gyro) or 10 (accel) are expected");
  if (imu.time_offset_s && !(std::abs(*imu.time_offset_s) <= 10))
    faults.add("imu.time_offset_s: at most 10 s are expected");
  if (const Status status = faults.status(); !status.ok()) fail(status.error());
  ImuCalibration calibration;
  calibration.T_camera_imu = to_se3(imu.T_camera_imu, "imu.T_camera_imu");
  calibration.noise = {imu.rate_hz, imu.gyro_noise_radps_sqrthz, imu.accel_noise_mps2_sqrthz,
                       imu.gyro_walk_radps2_sqrthz, imu.accel_walk_mps3_sqrthz};
  calibration.time_offset_s = imu.time_offset_s;
  return calibration;
}

Wheels Wheels::read(const std::string& path) {
  const auto read = read_wheel_calibration(path);
  if (!read.ok()) fail(read.error());
  return {to_api(read->T_base_camera),
          read->way_scale,
          read->turn_scale,
          read->way_noise,
          read->turn_noise,
          read->time_offset_s};
}

WheelCalibration to_calibration(const Wheels& wheels) {
  const auto is_between = [](double value, double least, double most) {
    return value >= least && value <= most;
  };
  ConfigFaults faults;
  constexpr double kMostLever_m = 100;
  if (!is_pose(wheels.T_base_camera) || !is_within(wheels.T_base_camera, kMostLever_m))
    faults.add("wheels.T_base_camera: at most 100 m and a unit quaternion are expected");
  if (!is_between(wheels.way_scale, 0.5, 2) || !is_between(wheels.turn_scale, 0.5, 2))
    faults.add("wheels: way_scale and turn_scale of 0.5 to 2 are expected");
  if (!is_between(wheels.way_noise, 1e-5, 1) || !is_between(wheels.turn_noise, 1e-5, 1))
    faults.add("wheels: way_noise and turn_noise of 1e-5 to 1 are expected");
  if (!is_between(wheels.time_offset_s, -10, 10))
    faults.add("wheels.time_offset_s: at most 10 s are expected");
  if (const Status status = faults.status(); !status.ok()) fail(status.error());
  return {to_se3(wheels.T_base_camera, "wheels.T_base_camera"),
          wheels.way_scale,
          wheels.turn_scale,
          wheels.way_noise,
          wheels.turn_noise,
          wheels.time_offset_s};
}

std::optional<Gravity> floor_of(const Settings& settings) {
  if (!settings.floor) return std::nullopt;
  return Gravity{vec3_of(settings.floor->up_world).normalized(), settings.floor->floor_m, true};
}

CameraConfig to_config(const CameraModel& m) {
  CameraConfig c;
  c.fx = m.fx, c.fy = m.fy, c.cx = m.cx, c.cy = m.cy;
  c.k1 = m.k1, c.k2 = m.k2, c.p1 = m.p1, c.p2 = m.p2, c.k3 = m.k3;
  c.colour_readout_ms = m.colour_readout_ms;
  c.depth_readout_ms = m.depth_readout_ms;
  c.depth_delay_ms = m.depth_delay_ms;
  c.shutter_known = !m.shutter_guessed && (m.shutter_known || !shutter_times(c).is_global());
  c.width = m.width, c.height = m.height;
  if (!m.device.empty() && !m.shutter_known)
    for (double* time_ms : {&c.colour_readout_ms, &c.depth_readout_ms, &c.depth_delay_ms})
      if (*time_ms == 0) *time_ms = std::numeric_limits<double>::quiet_NaN();
  if (const auto fault = apply_device(m.device, c))
    fail({ErrorKind::kConfig, "camera: " + fault->key + ": " + fault->reason});
  suspect_device(m, c);
  ignore_pixels(m, c);
  return c;
}

std::string shutter_source_of(const CameraModel& m) {
  if (!m.shutter_source.empty()) return m.shutter_source;
  const bool has_times = m.shutter_known || m.colour_readout_ms != 0 || m.depth_readout_ms != 0 ||
                         m.depth_delay_ms != 0;
  if (has_times) return {};  // the caller's own
  const CameraDevice* device = find_camera_device(m.device.empty() ? m.likely_device : m.device);
  return device == nullptr ? std::string() : std::string(device->title);
}

std::shared_ptr<const DepthRegistration> registration_of(const Settings& settings,
                                                         const CameraConfig& colour) {
  if (!settings.depth_camera) return nullptr;
  const auto& [model, T_colour_depth] = *settings.depth_camera;
  const CameraConfig depth = to_config(model);
  for (const CameraFault& fault : camera_faults(depth))
    fail({ErrorKind::kConfig, "depth_camera: " + fault.key + " " + fault.reason});
  if (depth.width <= 0 || depth.height <= 0)
    fail({ErrorKind::kConfig, "depth_camera: width and height must be positive"});
  if (!is_pose(T_colour_depth))
    fail({ErrorKind::kConfig,
          "depth_camera: T_colour_depth: finite numbers and a unit quaternion are expected"});
  return depth_registration({depth, to_se3(T_colour_depth, "T_colour_depth")}, colour);
}

void ignore_pixels(const CameraModel& m, CameraConfig& c) {
  c.ignored.clear();
  if (!m.ignore_image.empty()) {
    const std::string_view name = m.ignore_image;
    if (const std::string wrong = read_ignored({&name, 1}, ".", c); !wrong.empty())
      fail({ErrorKind::kConfig, "camera: ignore_image: " + wrong});
  }
  for (const auto& [x, y, width, height] : m.ignore) c.ignored.push_back({x, y, width, height});
}

log::SinkPtr sink_of(const Settings& settings) {
  if (!settings.log) return standard_error_sink();
  return std::make_shared<const log::Sink>(
      [log = settings.log](log::Level level, const std::string& line) {
        log(level == log::Level::kError     ? LogLevel::kError
            : level == log::Level::kWarning ? LogLevel::kWarning
                                            : LogLevel::kInfo,
            one_line(line));
      });
}

}  // namespace ygslam::api
