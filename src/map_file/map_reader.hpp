// Rows to map. Goes on after faults: what is good can be saved.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "map/archive.hpp"
#include "map_file/open_map.hpp"
#include "map_file/row_blob.hpp"

namespace ygslam::map_file {

/// Told of each fault. @return whether to go on.
using FaultSink = std::function<bool(const std::string&)>;

class MapReader {
 public:
  /// @param opened, camera, on_fault must outlive it. @param camera of the file.
  MapReader(OpenedMap& opened, const Camera& camera, const FaultSink& on_fault);

  /// @return the map of all rows that are good; nothing where the sink did not want to go on.
  std::optional<Map> read();

 private:
  using Ids = std::vector<std::uint32_t>;
  /// A keyframe that could not be read whole, as far as it could.
  struct Lost {
    KeyframeId parent = kNoKeyframe;  ///< a kept one, or none where none is older
    std::optional<SE3> T_camera_world;
  };

  void fault(const std::string& what);
  void fault(const RowKey& key, const std::string& what);
  [[nodiscard]] Ids ids_of(Table table);
  /// Calls read(in) with the row's content. @return whether all was well.
  bool with_row(const RowKey& key, const std::function<void(ArchiveReader&)>& read);
  bool load(const RowKey& key);

  void read_keyframes();
  void read_keyframe(KeyframeId id);
  void read_removed();
  void add_removed();
  void read_landmarks();
  void read_chunk(std::uint32_t chunk);
  void add_landmark(Landmark landmark, std::uint8_t source);
  void check_sums();
  [[nodiscard]] KeyframeId kept_before(KeyframeId id) const;
  [[nodiscard]] KeyframeId kept_parent(KeyframeId id, KeyframeId parent);

  OpenedMap& opened_;
  const Camera& camera_;
  const FaultSink& on_fault_;
  bool stopped_ = false;
  bool complete_ = true;  // no row was given up
  MapAssembly assembly_;
  std::vector<std::optional<Statement>> by_id_;
  RowCodec codec_;
  DecodeBudget budget_;
  std::uint64_t digest_ = 0;
  std::uint64_t observations_ = 0;
  std::map<KeyframeId, Lost> lost_;
  std::map<KeyframeId, RemovedKeyframe> removed_;
  RowContent row_;
};

}  // namespace ygslam::map_file
