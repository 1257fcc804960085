#include "live/run_topics.hpp"

namespace ygslam {
namespace {

template <typename Make>
void publish(const char* topic, Timestamp stamp, MessageSink& sink, Make make) {
  if (!sink.wants(topic)) return;
  const auto message = make();
  sink.put(topic, decltype(message)::kType, stamp, to_cdr(message));
}

}  // namespace

void publish_frame(const RgbdFrame& frame, const TrackResult& result, const CameraConfig& camera,
                   MessageSink& sink) {
  const auto put = [&](const char* topic, auto make) { publish(topic, frame.stamp, sink, make); };
  put("/tf", [&] { return tf_message(frame, result); });
  put("/odometry", [&] { return odometry_message(frame, result); });
  put("/camera/image/compressed", [&] { return image_message(frame); });
  put("/camera/camera_info", [&] { return camera_info_message(camera, frame.stamp); });
  put("/camera/annotations", [&] { return annotation_message(frame, result); });
  put("/objects", [&] { return object_message(frame, result); });
  put("/state", [&] { return state_message(frame, result); });
}

void publish_map(Runner& runner, Timestamp stamp, std::size_t most_points, MessageSink& sink) {
  if (sink.wants("/landmarks") || sink.wants("/path") || sink.wants("/loops")) {
    const Map map = runner.map();
    publish("/landmarks", stamp, sink, [&] { return landmark_message(map, stamp); });
    publish("/path", stamp, sink, [&] { return path_message(map, stamp); });
    publish("/loops", stamp, sink,
            [&] { return loop_message(map, runner.loop_attempts(), stamp); });
  }
  publish("/cloud", stamp, sink, [&] { return cloud_message(runner.cloud(), most_points, stamp); });
}

bool wants_map(const MessageSink& sink) {
  return sink.wants("/landmarks") || sink.wants("/path") || sink.wants("/loops") ||
         sink.wants("/cloud");
}

}  // namespace ygslam
