// A rendered sequence as messages: what a ROS camera would say, and the true pose.
#pragma once

#include <filesystem>
#include <optional>

#include "bag/mcap_writer.hpp"
#include "image/coloured_point.hpp"
#include "simulation/sequence/sequence_source.hpp"
#include "tracking/tracker.hpp"

namespace ygslam {

/// The truth in the terms of a run, for those who show one: a camera that is tracked without error
/// from the first frame on, where the world has its origin.
class TrueResults {
 public:
  [[nodiscard]] TrackResult of(const sim::SimulatedFrame& frame);

 private:
  std::optional<SE3> T_first_world_;
};

/// What the camera sees of the world, by the true depth: some of its pixels as points.
[[nodiscard]] std::vector<ColouredPoint> visible_points(const sim::SimulatedFrame& frame,
                                                        const Camera& camera,
                                                        const SE3& T_world_camera);

/// Writes a recording that `ygslam run` reads: colour as JPEG or PNG, depth in millimetres
/// (REP 118), both cameras, /tf_static between them where there are two; /tf and /odometry with the
/// true pose.
class SimulationRecorder {
 public:
  /// @return as McapWriter::create().
  static Result<SimulationRecorder> create(const std::filesystem::path& file,
                                           const sim::SequenceSource& source, bool jpeg);
  /// What of the frame arrives.
  Status add(const sim::SimulatedFrame& frame);
  Status finish() { return writer_.finish(); }

 private:
  SimulationRecorder(McapWriter writer, const sim::SequenceSource& source, bool jpeg)
      : writer_(std::move(writer)),
        camera_(source.camera().config()),
        depth_camera_(source.depth_camera()),
        jpeg_(jpeg) {}
  template <typename Message>
  Status write(const char* topic, Timestamp stamp, const Message& message) {
    return writer_.write(topic, Message::kType, stamp, to_cdr(message));
  }
  Status add_colour(const sim::SimulatedFrame& frame);
  Status add_depth(const sim::SimulatedFrame& frame);
  Status place_depth_camera(Timestamp stamp);

  McapWriter writer_;
  CameraConfig camera_;
  std::optional<DepthCamera> depth_camera_;
  bool jpeg_;
  bool is_placed_ = false;  // the depth camera
  TrueResults truth_;
};

}  // namespace ygslam
