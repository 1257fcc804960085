#include "app/simulate_inertial.hpp"

#include <CLI/CLI.hpp>
#include <vector>

#include "app/option_checks.hpp"

namespace ygslam {
namespace {

std::vector<std::string> model_names() {
  std::vector<std::string> names;
  for (const sim::ImuModel& model : sim::imu_models()) names.emplace_back(model.name);
  return names;
}

}  // namespace

void add_inertial_options(CLI::App& command, InertialOptions& o) {
  constexpr double kMostRate_hz = 4000;
  CLI::Option* imu =
      command
          .add_option("--imu", o.imu,
                      "Also write what this inertial sensor on the camera reads: imu.csv, imu.yaml")
          ->check(CLI::IsMember(model_names()))
          ->excludes("--poses");
  command.add_option("--imu-rate", o.imu_rate_hz, "Readings per second")
      ->check(in_range(10.0, kMostRate_hz))
      ->type_name("N")
      ->capture_default_str()
      ->needs(imu);
  command
      .add_option("--imu-offset-ms", o.imu_offset_ms, "Its stamps are so much later than the truth")
      ->check(in_range(-100.0, 100.0))
      ->type_name("MS")
      ->needs(imu);
  command
      .add_flag("--imu-uncalibrated", o.imu_uncalibrated,
                "Offset, scale and misalignment of the bare chip, not a tenth of them")
      ->needs(imu);
  CLI::Option* wheels =
      command
          .add_flag("--wheels", o.wheels,
                    "Also write what two wheels below the camera tell: odom.csv. For robots' paths "
                    "(path: drive)")
          ->excludes("--poses");
  command.add_option("--wheel-slips", o.slips_per_100m, "How often a wheel spins on 100 m")
      ->check(in_range(0.0, 1000.0))
      ->type_name("N")
      ->needs(wheels);
}

sim::ImuOptions imu_options(const InertialOptions& options, std::uint64_t seed) {
  const sim::ImuModel* model = sim::find_imu_model(options.imu);
  CHECK(model != nullptr, "the command line knows the models");
  sim::ImuOptions imu;
  imu.model = *model;
  imu.rate_hz = options.imu_rate_hz;
  imu.time_offset_s = 1e-3 * options.imu_offset_ms;
  if (options.imu_uncalibrated) imu.uncalibrated_share = 1;
  imu.seed = seed;
  return imu;
}

sim::WheelOptions wheel_options(const InertialOptions& options, std::uint64_t seed) {
  sim::WheelOptions wheels;
  wheels.slips_per_100m = options.slips_per_100m;
  wheels.seed = seed;
  return wheels;
}

Status write_inertial(const std::filesystem::path& folder, const sim::SequenceSource& source,
                      const InertialOptions& options, std::uint64_t seed, int frames, bool truth) {
  const double until_s = (frames - 1) / source.fps();
  Status status = Ok{};
  if (!options.imu.empty())
    status = sim::write_imu_files(folder, source, imu_options(options, seed), until_s, truth);
  if (status.ok() && options.wheels)
    status = sim::write_wheel_file(folder, source, wheel_options(options, seed), until_s);
  return status;
}

RecordedSensors recorded_sensors(const sim::SequenceSource& source, const InertialOptions& options,
                                 std::uint64_t seed) {
  constexpr double kMargin_s = 0.1;  // as in the files
  const double until_s = (source.frame_count() - 1) / source.fps() + kMargin_s;
  RecordedSensors sensors;
  if (!options.imu.empty()) {
    const sim::ImuOptions imu = imu_options(options, seed);
    sensors.imu_calibration = sim::known_calibration(imu);
    for (const sim::ImuReading& reading :
         sim::imu_readings(source.path(), imu, source.start(), -kMargin_s, until_s))
      sensors.imu.push_back(reading.sample);
  }
  if (options.wheels) {
    sim::WheelReadings readings = sim::wheel_readings(source.path(), wheel_options(options, seed),
                                                      source.start(), -kMargin_s, until_s);
    sensors.wheels = std::move(readings.samples);
    sensors.T_base_camera = readings.T_base_camera;
  }
  return sensors;
}

void tell_inertial(const InertialOptions& options, nlohmann::ordered_json& json) {
  const bool has_imu = !options.imu.empty();
  json["imu"] = has_imu ? nlohmann::ordered_json(options.imu) : nlohmann::ordered_json();
  json["imu_rate_hz"] = options.imu_rate_hz;
  json["imu_offset_ms"] = options.imu_offset_ms;
  json["imu_uncalibrated"] = options.imu_uncalibrated;
  json["wheels"] = options.wheels;
  json["wheel_slips"] = options.slips_per_100m;
}

}  // namespace ygslam
