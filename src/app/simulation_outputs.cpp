#include "app/simulation_outputs.hpp"

#include "app/stop_signal.hpp"

namespace ygslam {

Status SimulationOutputs::add(const sim::SimulatedFrame& frame, const sim::SequenceSource& source) {
  Status status = files ? files->add(frame, source) : Status(Ok{});
  if (status.ok() && recording) status = recording->add(frame);
  return status;
}

Status SimulationOutputs::finish(const sim::SequenceSource& source) {
  Status status = files ? files->finish(source) : Status(Ok{});
  if (status.ok() && recording) status = recording->finish();
  return status;
}

bool SimulationOutputs::show(const sim::SimulatedFrame& frame, const sim::SequenceSource& source) {
  if (!view) return true;
  const auto interrupted = [] { return StopSignal::received() != 0; };
  while (!interrupted()) {
    const auto wishes = view->wait_turn(frame.frame->stamp, nullptr, interrupted);
    if (wishes.stop) return false;
    if (!wishes.go) continue;
    const TrackResult result = truth.of(frame);
    view->show(frame.frame, result);
    view->show_cloud([&] { return visible_points(frame, source.camera(), result.T_world_camera); });
    return true;
  }
  return false;
}

Result<SimulationOutputs> open_outputs(const sim::SequenceSource& source, const std::string& out,
                                       const std::string& mcap, const ViewOptions& view,
                                       RecordedSensors sensors, const sim::WriteOptions& options) {
  SimulationOutputs outputs;
  if (!mcap.empty())
    if (Status status = McapWriter::check(mcap); !status) return status.error();
  if (view.address) {
    auto started =
        start_page(view, {.camera = source.camera().config(), .map = RunViewConfig::Map::kNone});
    if (!started) return started.error();
    outputs.view = std::move(*started);
  }
  if (!out.empty()) {
    auto files = sim::SequenceWriter::create(out, source, options);
    if (!files) return files.error();
    outputs.files = std::move(*files);
  }
  if (!mcap.empty()) {
    auto recording = SimulationRecorder::create(mcap, source, options.jpeg);
    if (!recording) return recording.error();
    outputs.recording = std::move(*recording);
    outputs.recording->also(std::move(sensors));
  }
  return outputs;
}

}  // namespace ygslam
