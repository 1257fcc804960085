// Map to rows: what has changed since the last time goes into the file in one transaction.
#pragma once

#include <filesystem>
#include <unordered_map>

#include "map_file/open_map.hpp"
#include "map_file/row_blob.hpp"

namespace ygslam::map_file {

class MapStore {
 public:
  /// A new file with empty tables, not yet a map: that it becomes with the first write(). It keeps
  /// no journal on the disk, so that it is worth nothing until it is closed.
  static Result<MapStore> create(const std::filesystem::path& path, MapFileInfo info);
  /// A file whose map goes on, with a write-ahead log.
  /// @param meta what stands there.
  static Result<MapStore> go_on(const std::filesystem::path& path, Meta meta);

  /// @return kOutput; what was written before stays.
  Status write(const Map& map);
  /// Makes it one file without companions.
  Status close();

 private:
  using Hashes = std::unordered_map<std::uint32_t, std::uint64_t>;  // by row
  struct Change;

  MapStore(std::filesystem::path path, Database database, Meta meta);
  [[nodiscard]] Error error(const std::string& what) const;
  Status read_hashes();
  Status write_rows(const Map& map, Change& change);
  Status write_landmarks(const Map& map, Change& change);
  Status write_removed(const Map& map, Change& change);
  /// Writes change.raw if the file has the row otherwise.
  Status put(const RowKey& key, Change& change);
  Status delete_others(const Change& change);
  Status write_meta();

  std::filesystem::path path_;
  Database database_;
  Meta meta_;
  Camera camera_;  // what features are said by; after meta_
  bool is_new_ = false;
  // What the rows of `seen` were made of: it never changes, and two worlds never share it.
  std::unordered_map<std::uint32_t, std::weak_ptr<const KeyframeData>> seen_;
  std::array<Hashes, kTables> hashes_;
  RowCodec codec_;
};

}  // namespace ygslam::map_file
