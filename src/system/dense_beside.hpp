// Whose the dense map is that lies beside a map file: another map's is neither used nor lost.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "system/dense_file.hpp"

namespace ygslam {

/// What a map has of the dense map beside it.
struct DenseBeside {
  std::vector<SavedView> views;  ///< tied to keyframes of the map
  std::size_t left_out = 0;      ///< tied to keyframes that it has not
  std::string foreign;           ///< the file is another map's: why; nothing of it is used
};
/// @return as load_dense_views(); of another map's file nothing but its header is looked at.
[[nodiscard]] Result<DenseBeside> load_dense_beside(const std::filesystem::path& dense_file,
                                                    const Map& map, const Camera& camera);

/// @return why it is another map's; empty if it is not, as far as it says whose it is.
[[nodiscard]] std::string foreign_text(const DenseFileInfo& info,
                                       const std::optional<MapIdentity>& map);

/// Whether what lies there may be written over: nothing, or a dense map of one of these.
[[nodiscard]] bool is_dense_of(const std::filesystem::path& dense_file,
                               std::span<const MapIdentity> maps);

/// Gives it another name, FILE.1 or the next that is free. @return that name; kOutput.
[[nodiscard]] Result<std::filesystem::path> put_aside(const std::filesystem::path& dense_file);

}  // namespace ygslam
