#include "live/run_recorder.hpp"

#include <limits>

#include "core/trace.hpp"

namespace ygslam {
namespace {

constexpr double kMapEvery_s = 1;
constexpr double kMeshEvery_s = 5;  // takes longer than the rest of the map
constexpr std::size_t kMostPointsAtOnce = 100'000;

}  // namespace

Result<RunRecorder> RunRecorder::create(const std::filesystem::path& file,
                                        const CameraConfig& camera) {
  auto writer = McapWriter::create(file);
  if (!writer.ok()) return writer.error();
  return RunRecorder(std::move(writer).value(), camera);
}

bool RunRecorder::wants(std::string_view /*topic*/) const { return status_.ok(); }

void RunRecorder::put(std::string_view topic, const char* type, Timestamp stamp, Bytes cdr,
                      std::uint32_t /*part*/) {
  if (status_.ok()) status_ = writer_.write(std::string(topic), type, stamp, cdr);
}

Status RunRecorder::add(const RgbdFrame& frame, const TrackResult& result, Runner& runner) {
  const trace::Span span("record");
  now_ = frame.stamp;
  publish_frame(frame, result, camera_, *this);
  if (!map_stamp_ || seconds_between(now_, *map_stamp_) >= kMapEvery_s)
    return add_map(runner, kMostPointsAtOnce, false);
  return status_;
}

Status RunRecorder::add_map(Runner& runner, std::size_t most_points, bool at_end) {
  map_stamp_ = now_;
  if (at_end || !mesh_stamp_ || seconds_between(now_, *mesh_stamp_) >= kMeshEvery_s) {
    mesh_stamp_ = now_;
    NamedMesh mesh = MeshTopics::take(runner);
    publish_map(runner, now_, most_points, *this, &mesh);
    using Extent = MeshTopics::Extent;
    mesh_.publish(std::move(mesh), now_, at_end ? Extent::kWhole : Extent::kChanged, *this);
  } else {
    publish_map(runner, now_, most_points, *this);
  }
  if (status_.ok()) status_ = writer_.flush();
  return status_;
}

Status RunRecorder::finish(Runner& runner) {
  if (map_stamp_) static_cast<void>(add_map(runner, std::numeric_limits<std::size_t>::max(), true));
  return status_.ok() ? writer_.finish() : status_;
}

}  // namespace ygslam
