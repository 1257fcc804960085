// Keeps a map file up to date while the map grows, in a thread of its own.
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>

#include "core/bounded_queue.hpp"
#include "core/time.hpp"
#include "core/worker_thread.hpp"
#include "map_file/map_file.hpp"

namespace ygslam {

class MapSaver {
 public:
  /// @param every_s how much of the map may be lost when the process ends without a word.
  /// @return as MapWriter::open().
  static Result<std::unique_ptr<MapSaver>> open(const std::filesystem::path& path,
                                                const Camera& camera, const PyramidScales& scales,
                                                double every_s = 4);
  ~MapSaver();
  MapSaver(const MapSaver&) = delete;
  MapSaver& operator=(const MapSaver&) = delete;

  /// Takes a copy where it is time to write. Returns at once.
  void look(const Map& map);
  /// Writes it soon, whatever the time. Returns at once.
  void save(const Map& map) { queue_.push(map); }
  /// The map as it is at the end. @return what could not be written (kOutput).
  Status finish(const Map& map);

 private:
  MapSaver(MapWriter writer, double every_s);
  void write(const Map& map);

  MapWriter writer_;  // the thread's while it runs
  const double every_s_;
  ScopedTimer since_last_;
  bool warned_ = false;  // the thread's while it runs
  BoundedQueue<Map> queue_{1, Overflow::kDropOldest, "map file"};
  WorkerThread thread_;  // last: it uses everything above
};

}  // namespace ygslam
