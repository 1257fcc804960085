// What a run is to do: its options, its settings and its input, read and checked against each other
// before anything is written.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "app/motion_input.hpp"
#include "app/run_options.hpp"

namespace ygslam {

struct RunPlan {
  RunOptions options;
  SessionOptions session;  ///< its settings are the run's, resolved; without the map's sink
  Sequence sequence;
  FrameReaderConfig reading;
  std::vector<ImuSample> imu;          ///< readings of SlamConfig::imu
  std::vector<OdometrySample> wheels;  ///< of SlamConfig::wheels

  [[nodiscard]] const SlamConfig& settings() const { return session.config; }
  /// Beside --save-map; none without a dense map.
  [[nodiscard]] std::optional<std::filesystem::path> dense_file() const;
  /// "deterministic", "realtime" or "file".
  [[nodiscard]] const char* schedule() const;
};

/// @return all faults of the settings at once (kConfig), kUsage for options that do not go together
/// or with the input; see open_sequence() and check_targets(). Waits for the first frames of a
/// stream.
[[nodiscard]] Result<RunPlan> plan_run(const RunOptions& options);

}  // namespace ygslam
