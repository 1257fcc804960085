#include "live/run_topics.hpp"

#include <algorithm>
#include <iterator>

namespace ygslam {
namespace {

constexpr std::size_t kMostTriangles = 100'000;  // of the mesh, 120 bytes each
constexpr double kSpeck_m2 = 0.03;               // as a postcard: a smaller piece alone is noise

template <typename Make>
void publish(const char* topic, Timestamp stamp, MessageSink& sink, Make make) {
  if (!sink.wants(topic)) return;
  const auto message = make();
  sink.put(topic, decltype(message)::kType, stamp, to_cdr(message), 0);
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

void publish_map(Runner& runner, Timestamp stamp, std::size_t most_points, MessageSink& sink,
                 const NamedMesh* mesh) {
  if (sink.wants("/landmarks") || sink.wants("/path") || sink.wants("/loops")) {
    const Map map = runner.map();
    publish("/landmarks", stamp, sink, [&] { return landmark_message(map, stamp); });
    publish("/path", stamp, sink, [&] { return path_message(map, stamp); });
    publish("/loops", stamp, sink,
            [&] { return loop_message(map, runner.loop_attempts(), stamp); });
  }
  publish("/cloud", stamp, sink, [&] {
    return cloud_message(mesh ? coloured_points(mesh->mesh) : runner.cloud(), most_points, stamp);
  });
}

bool wants_map(const MessageSink& sink) {
  return sink.wants("/landmarks") || sink.wants("/path") || sink.wants("/loops") ||
         sink.wants("/cloud") || MeshTopics::wanted(sink);
}

bool MeshTopics::wanted(const MessageSink& sink) {
  return sink.wants("/mesh") || sink.wants("/mesh/classes");
}

NamedMesh MeshTopics::take(Runner& runner) {
  NamedMesh named;
  runner.inspect_dense([&](DenseMap& dense) { named = named_mesh(dense); });
  return named;
}

void MeshTopics::publish(NamedMesh named, Timestamp stamp, Extent extent, MessageSink& sink) {
  TriangleMesh labelled;
  if (!named.mesh.triangles.empty()) {
    const Gravity gravity = gravity_of(named);
    labelled = labelled_mesh(std::move(named), gravity);
    if (extent == Extent::kTiles)
      ygslam::publish("/floor", stamp, sink, [&] { return floor_message(gravity, stamp); });
  }
  // To look at, not to keep: a recording ends with all of it.
  const double least_m2 = extent == Extent::kTiles ? kSpeck_m2 : 0;
  const ClusteredMesh mesh =
      without_specks(reduced_mesh(labelled, cell_m_, kMostTriangles), least_m2);
  cell_m_ = mesh.mesh.triangles.empty() ? 0 : mesh.cell_m;
  const auto put = [&](const char* topic, const ros::MarkerArray& message, std::uint32_t part) {
    sink.put(topic, ros::MarkerArray::kType, stamp, to_cdr(message), part);
  };
  for (Topic& topic : topics_) {
    if (!sink.wants(topic.name)) continue;
    ros::MarkerArray all;
    if (extent == Extent::kWhole) {
      topic.tiles.clear();
      all.markers.emplace_back().action = ros::Marker::kDeleteAll;
      all.markers.back().header = {ros::to_ros(stamp), "map"};
    }
    for (MeshTile& tile : topic.tiles.changed(mesh, ros::to_ros(stamp))) {
      if (extent == Extent::kTiles)
        put(topic.name, {std::move(tile.markers)}, tile.number);
      else
        std::ranges::move(tile.markers, std::back_inserter(all.markers));
    }
    if (!all.markers.empty()) put(topic.name, all, 0);
  }
}

}  // namespace ygslam
