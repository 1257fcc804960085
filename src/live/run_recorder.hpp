// Writes what a run shows of itself into an MCAP file.
#pragma once

#include <filesystem>
#include <functional>

#include "bag/mcap_writer.hpp"
#include "live/run_messages.hpp"
#include "system/runner.hpp"

namespace ygslam {

class RunRecorder {
 public:
  /// @return as McapWriter::create().
  static Result<RunRecorder> create(const std::filesystem::path& file, const CameraConfig& camera);

  /// After the frame was processed. What is known of the map is recorded once a second.
  Status add(const RgbdFrame& frame, const TrackResult& result, Runner& runner);
  /// The map as it is at the end, under the last frame's stamp.
  Status finish(Runner& runner);

 private:
  RunRecorder(McapWriter writer, const CameraConfig& camera)
      : writer_(std::move(writer)), camera_(camera) {}
  Status add_map(Runner& runner, std::size_t most_points);
  template <typename Message>
  void put(const char* topic, const Message& message) {
    if (status_.ok()) status_ = writer_.write(topic, now_, message);
  }

  McapWriter writer_;
  CameraConfig camera_;
  Timestamp now_;
  std::optional<Timestamp> map_stamp_;
  Status status_ = Ok{};
};

}  // namespace ygslam
