#include "live/run_recorder.hpp"

namespace ygslam {
namespace {

constexpr double kMapEveryS = 1;
constexpr std::size_t kMostPointsAtOnce = 100'000;

}  // namespace

Result<RunRecorder> RunRecorder::create(const std::filesystem::path& file,
                                        const CameraConfig& camera) {
  auto writer = McapWriter::create(file);
  if (!writer.ok()) return writer.error();
  return RunRecorder(std::move(writer).value(), camera);
}

Status RunRecorder::add(const RgbdFrame& frame, const TrackResult& result, Runner& runner) {
  now_ = frame.stamp;
  put("/tf", tf_message(frame, result));
  put("/odometry", odometry_message(frame, result));
  put("/camera/image/compressed", image_message(frame));
  put("/camera/camera_info", camera_info_message(camera_, now_));
  put("/camera/annotations", annotation_message(frame, result));
  put("/objects", object_message(frame, result));
  put("/state", state_message(frame, result));
  if (!map_stamp_ || seconds_between(now_, *map_stamp_) >= kMapEveryS)
    return add_map(runner, kMostPointsAtOnce);
  return status_;
}

Status RunRecorder::add_map(Runner& runner, std::size_t most_points) {
  map_stamp_ = now_;
  const Map map = runner.map();
  put("/landmarks", landmark_message(map, now_));
  put("/path", path_message(map, now_));
  put("/cloud", cloud_message(runner.cloud(), most_points, now_));
  if (status_.ok()) status_ = writer_.flush();
  return status_;
}

Status RunRecorder::finish(Runner& runner) {
  if (map_stamp_) static_cast<void>(add_map(runner, std::numeric_limits<std::size_t>::max()));
  return status_.ok() ? writer_.finish() : status_;
}

}  // namespace ygslam
