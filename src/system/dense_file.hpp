// The dense map's keyframes on disk, beside the map file that has their poses: FILE.dense.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/result.hpp"
#include "dense/dense_map.hpp"
#include "map/map.hpp"

namespace ygslam {

/// room.map.dense of room.map.
[[nodiscard]] std::filesystem::path dense_file_of(const std::filesystem::path& map_file);

/// Whole or not at all; an older file stays until then.
/// @param map whose keyframes the views are tied to. @return kOutput.
[[nodiscard]] Status save_dense_views(const std::filesystem::path& path, const Camera& camera,
                                      const Map& map, const std::vector<SavedView>& views);

struct DenseFileInfo {
  std::optional<MapIdentity> map;  ///< whose it is; format 2 did not say so
  std::uint64_t views = 0;
  std::uint64_t bytes = 0;  ///< on disk
};
/// Of a file that begins as one; its views are not looked at. @return kSavedMap.
[[nodiscard]] Result<DenseFileInfo> read_dense_info(const std::filesystem::path& path);

struct DenseFile {
  std::optional<MapIdentity> map;
  std::vector<SavedView> views;
  std::vector<std::uint64_t> sights;  ///< of each view's keyframe (sight_of); none without `map`
};
/// Everything is checked: header, camera, the checksum of each view, and what it holds.
/// @return kSavedMap in one line naming file and cause.
[[nodiscard]] Result<DenseFile> load_dense_views(const std::filesystem::path& path,
                                                 const Camera& camera);

/// The keyframe that a view is tied to: its own, or that which tells its place.
struct DenseTie {
  KeyframeId keyframe = kNoKeyframe;
  Timestamp stamp;
};
[[nodiscard]] inline DenseTie tie_of(const SavedView& view) {
  if (view.anchor) return {view.anchor->keyframe, view.anchor->stamp};
  return {view.id.keyframe, view.stamp};
}

}  // namespace ygslam
