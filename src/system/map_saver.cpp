#include "system/map_saver.hpp"

#include "core/log.hpp"
#include "core/trace.hpp"

namespace ygslam {

Result<std::unique_ptr<MapSaver>> MapSaver::open(const std::filesystem::path& path,
                                                 const Camera& camera, const PyramidScales& scales,
                                                 double every_s) {
  auto writer = MapWriter::open(path, camera, scales);
  if (!writer.ok()) return writer.error();
  return std::unique_ptr<MapSaver>(new MapSaver(std::move(writer).value(), every_s));
}

MapSaver::MapSaver(MapWriter writer, double every_s)
    : writer_(std::move(writer)), every_s_(every_s), thread_([this](const std::stop_token& stop) {
        trace::name_thread("map file");
        while (const auto map = queue_.pop(stop)) write(*map);
      }) {}

MapSaver::~MapSaver() {
  thread_.request_stop();
  queue_.close();
}

void MapSaver::look(const Map& map) {
  if (1e-3 * since_last_.wall_ms() < every_s_) return;
  since_last_ = ScopedTimer();
  save(map);
}

void MapSaver::write(const Map& map) {
  const trace::Span span("write map");
  const Status written = writer_.write(map);
  if (!written.ok() && !std::exchange(warned_, true))
    log::warn("{}; tracking goes on, the next try is in some seconds", written.error().message);
}

Status MapSaver::finish(const Map& map) {
  queue_.close();
  if (thread_.joinable()) thread_.join();
  thread_.rethrow();
  if (Status written = writer_.write(map); !written.ok()) return written;
  return writer_.close();
}

}  // namespace ygslam
