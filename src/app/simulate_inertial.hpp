// `ygslam simulate --imu MODEL --wheels`: what other sensors of the camera or its robot say.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "app/simulation_recorder.hpp"
#include "core/result.hpp"
#include "simulation/sequence/inertial_files.hpp"

namespace CLI {
class App;
}

namespace ygslam {

struct InertialOptions {
  std::string imu;  ///< model; empty = none
  double imu_rate_hz = 200;
  double imu_offset_ms = 0;
  bool imu_uncalibrated = false;
  bool wheels = false;
  double slips_per_100m = 0;

  [[nodiscard]] bool any() const { return wheels || !imu.empty(); }
};

void add_inertial_options(CLI::App& command, InertialOptions& options);

/// The model and its errors. @param seed of the sequence.
[[nodiscard]] sim::ImuOptions imu_options(const InertialOptions& options, std::uint64_t seed);
[[nodiscard]] sim::WheelOptions wheel_options(const InertialOptions& options, std::uint64_t seed);

/// The files of both, as far as they were asked for. @param frames how many were rendered.
[[nodiscard]] Status write_inertial(const std::filesystem::path& folder,
                                    const sim::SequenceSource& source,
                                    const InertialOptions& options, std::uint64_t seed, int frames,
                                    bool truth);

/// The readings of both, for a recording of the whole sequence.
[[nodiscard]] RecordedSensors recorded_sensors(const sim::SequenceSource& source,
                                               const InertialOptions& options, std::uint64_t seed);

/// Their part of simulation.json.
void tell_inertial(const InertialOptions& options, nlohmann::ordered_json& json);

}  // namespace ygslam
