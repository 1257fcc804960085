// The dense map's keyframes on disk, beside the map file that has their poses: FILE.dense.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/result.hpp"
#include "dense/dense_map.hpp"
#include "map/map.hpp"

namespace ygslam {

/// room.map.dense of room.map.
[[nodiscard]] std::filesystem::path dense_file_of(const std::filesystem::path& map_file);

/// Whole or not at all; an older file stays until then. @return kOutput.
[[nodiscard]] Status save_dense_views(const std::filesystem::path& path, const Camera& camera,
                                      const std::vector<SavedView>& views);

struct DenseFileInfo {
  std::uint64_t views = 0;
  std::uint64_t bytes = 0;  ///< on disk
};
/// Of a file that begins as one; its views are not looked at. @return kSavedMap.
[[nodiscard]] Result<DenseFileInfo> read_dense_info(const std::filesystem::path& path);

/// Everything is checked: header, camera, the checksum of each view, and what it holds.
/// @return kSavedMap in one line naming file and cause.
[[nodiscard]] Result<std::vector<SavedView>> load_dense_views(const std::filesystem::path& path,
                                                              const Camera& camera);

/// Those whose keyframe the map has: a file that another run left beside it fits only in part.
[[nodiscard]] std::vector<SavedView> views_of(const Map& map, std::vector<SavedView> views);

}  // namespace ygslam
