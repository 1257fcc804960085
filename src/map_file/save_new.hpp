// A whole map into a new file, for whoever holds the lock.
#pragma once

#include <filesystem>
#include <optional>

#include "io/atomic_file.hpp"
#include "map_file/map_file.hpp"

namespace ygslam::map_file {

/// @param target no symbolic link. @return kOutput; what was there stays.
Status save_new(const std::filesystem::path& target, const Map& map, MapFileInfo info);

/// Keeps other writers off a map file.
Result<std::optional<OutputLock>> lock_map(const std::filesystem::path& target);

}  // namespace ygslam::map_file
