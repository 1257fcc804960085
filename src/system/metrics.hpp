// metrics.json of a run (contract: "Output of run").
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "io/frame_reader.hpp"
#include "system/runner.hpp"

namespace ygslam {

struct RunFacts {
  std::string mode, segmenter, precision,
      schedule;  ///< schedule: "file", "realtime", "deterministic"
  std::uint64_t seed = 0;
  double startup_s = 0;
  double wall_s = 0;                  ///< without start-up
  std::size_t trajectory_frames = 0;  ///< in trajectory.txt
};

[[nodiscard]] nlohmann::ordered_json metrics_json(const SlamOutcome& outcome, const Map& map,
                                                  const FrameReaderCounts& input,
                                                  const RunFacts& facts);

/// The run in one line: frames, those that were missed, keyframes, landmarks, time.
[[nodiscard]] std::string summary_text(const SlamOutcome& outcome, const Map& map,
                                       const FrameReaderCounts& input, const RunFacts& facts);

/// Frames with a pose / all that were offered so far: what could not be read, and what was dropped,
/// is time without a pose.
[[nodiscard]] double coverage(const SlamOutcome& outcome);
[[nodiscard]] const char* version();
/// Of this machine, as the kernel tells it.
[[nodiscard]] std::string processor_name();

}  // namespace ygslam
