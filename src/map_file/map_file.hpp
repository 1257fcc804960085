// Maps on disk: one SQLite file each. What a file holds and promises: docs/maps.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "geometry/camera.hpp"
#include "map/map.hpp"

namespace ygslam {

/// What a map was made with, and how much it holds.
struct MapFileInfo {
  std::string uuid;             ///< of the map (Map::identity), the same while it goes on
  std::string created;          ///< UTC, 2026-01-31T12:00:00Z
  std::string program_version;  ///< that wrote it last
  CameraConfig camera;          ///< size, focal lengths, centre, distortion; the rest at default
  int pyramid_levels = 0;
  double pyramid_factor = 0;
  std::uint64_t generation = 0;  ///< how often it was written
  std::uint64_t keyframes = 0;
  std::uint64_t removed_keyframes = 0;
  std::uint64_t landmarks = 0;
  std::uint64_t observations = 0;
  std::uint64_t bytes = 0;  ///< on disk
};

/// Writes the map: whole or not at all. An older file stays until the new one is on the disk; a
/// symbolic link stays, what it points to is replaced.
/// @return kOutput naming file and reason, also where a MapWriter is at work on the file.
Status save_map(const std::filesystem::path& path, const Map& map, const Camera& camera);

/// Everything is checked: the file, its tables, the checksum of each row, that the rows belong
/// together, and what they say whatever their checksums.
/// @param camera, scales of this run: those the map was made with (depth scale and shutter may
/// differ).
/// @return kSavedMap in one line naming file and cause: no map, damaged, of another format, of
/// another camera or pyramid (both values).
Result<Map> load_map(const std::filesystem::path& path, const Camera& camera,
                     const PyramidScales& scales);
/// The same whatever camera it was made with.
Result<Map> load_map(const std::filesystem::path& path);

/// Reads the file's summary; its rows are not looked at.
Result<MapFileInfo> read_map_info(const std::filesystem::path& path);

struct MapCheck {
  MapFileInfo info;
  std::vector<std::string> faults;  ///< each names table and row, or keyframe or landmark
  std::uint64_t faults_in_all = 0;  ///< faults beyond the first hundred are counted only
};
/// Reads all and goes on after faults. @return an error where nothing can be read at all.
Result<MapCheck> check_map(const std::filesystem::path& path);

struct MapRecovery {
  MapCheck found;
  std::uint64_t keyframes = 0;  ///< in the new file
  std::uint64_t landmarks = 0;
  std::uint64_t observations = 0;
};
/// What is good of `from` into a new file `to`. A keyframe that lost its features stays as a pose
/// among the removed ones where its pose is known; children go to the next kept one before.
/// @return kUsage where `to` is there already.
Result<MapRecovery> recover_map(const std::filesystem::path& from, const std::filesystem::path& to);

/// Keeps a file up to date while its map grows: each write() is a transaction with the rows that
/// changed since the last. What write() has returned for survives the end of the process and a
/// loss of power.
class MapWriter {
 public:
  /// Goes on in a file that is there, else makes a new one. What is there stays until the first
  /// write().
  /// @return kOutput where it cannot be written or another writer is at work on it (its process is
  /// named), kSavedMap where what is there is no sound map of this camera and pyramid.
  static Result<MapWriter> open(const std::filesystem::path& path, const Camera& camera,
                                const PyramidScales& scales);
  MapWriter(MapWriter&&) noexcept;
  MapWriter& operator=(MapWriter&&) noexcept;
  /// Lets go of the file; what was not written is lost.
  ~MapWriter();

  /// After a fault (kOutput) the file is as it was, and the next call tries again.
  Status write(const Map& map);
  /// Makes it one file without companions. Nothing may be written later.
  Status close();

 private:
  struct State;
  explicit MapWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace ygslam
