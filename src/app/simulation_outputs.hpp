// Where the frames of `ygslam simulate` go: files, a recording, the live page.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "app/simulation_recorder.hpp"
#include "app/view_options.hpp"
#include "simulation/sequence/sequence_writer.hpp"

namespace ygslam {

/// As far as they were asked for.
struct SimulationOutputs {
  std::optional<sim::SequenceWriter> files;
  std::optional<SimulationRecorder> recording;
  std::unique_ptr<RunView> view;
  TrueResults truth;  ///< of the view

  // These may be called by a thread of their own.
  Status add(const sim::SimulatedFrame& frame, const sim::SequenceSource& source);
  Status finish(const sim::SequenceSource& source);

  /// On the page, when the frame is due. @return false if the rendering is to end.
  [[nodiscard]] bool show(const sim::SimulatedFrame& frame, const sim::SequenceSource& source);
};

/// @param out,mcap empty = none.
[[nodiscard]] Result<SimulationOutputs> open_outputs(
    const sim::SequenceSource& source, const std::string& out, const std::string& mcap,
    const ViewOptions& view, RecordedSensors sensors, const sim::WriteOptions& options);

}  // namespace ygslam
