// Writes what a run shows of itself into an MCAP file.
#pragma once

#include <filesystem>

#include "bag/mcap_writer.hpp"
#include "live/run_topics.hpp"

namespace ygslam {

class RunRecorder : private MessageSink {
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
  [[nodiscard]] bool wants(std::string_view topic) const override;
  void put(std::string_view topic, const char* type, Timestamp stamp, Bytes cdr,
           std::uint32_t part) override;
  Status add_map(Runner& runner, std::size_t most_points, bool at_end);

  McapWriter writer_;
  CameraConfig camera_;
  Timestamp now_;
  std::optional<Timestamp> map_stamp_, mesh_stamp_;
  MeshTopics mesh_;
  Status status_ = Ok{};
};

}  // namespace ygslam
