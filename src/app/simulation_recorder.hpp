// A rendered sequence as messages: what a ROS camera would say, and the true pose.
#pragma once

#include <filesystem>
#include <optional>

#include "bag/mcap_writer.hpp"
#include "geometry/imu.hpp"
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

/// What other sensors say during the whole sequence; empty = they are not there.
struct RecordedSensors {
  std::vector<ImuSample> imu;
  ImuCalibration imu_calibration;
  std::vector<OdometrySample> wheels;
  SE3 T_base_camera;
};

/// Writes a recording that `ygslam run` reads: colour as JPEG or PNG, depth in millimetres
/// (REP 118), both cameras, /tf_static between them where there are two; /tf and /odometry with the
/// true pose; /imu and /wheel_odometry, with /tf_static to both from the camera.
class SimulationRecorder {
 public:
  /// @return as McapWriter::create().
  static Result<SimulationRecorder> create(const std::filesystem::path& file,
                                           const sim::SequenceSource& source, bool jpeg);
  /// Readings go into the recording as time goes on, up to a tenth of a second behind the last
  /// frame.
  void also(RecordedSensors sensors) { sensors_ = std::move(sensors); }
  /// What of the frame arrives.
  Status add(const sim::SimulatedFrame& frame);
  Status finish();

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
  Status place_sensors(Timestamp stamp);
  Status add_readings(Timestamp until);

  McapWriter writer_;
  CameraConfig camera_;
  std::optional<DepthCamera> depth_camera_;
  bool jpeg_;
  bool is_placed_ = false;  // on /tf_static
  RecordedSensors sensors_;
  std::size_t next_imu_ = 0, next_wheels_ = 0;
  Timestamp last_;
  TrueResults truth_;
};

}  // namespace ygslam
