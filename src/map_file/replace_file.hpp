// A finished file takes the place of another.
#pragma once

#include <filesystem>

#include "core/result.hpp"

namespace ygslam::map_file {

/// The file that a path means: what a symbolic link points to.
/// @return kOutput for a folder, a device, a link to nowhere.
Result<std::filesystem::path> target_of(const std::filesystem::path& path);

/// A name in the target's folder that nothing has. Of its own length: the target's may be as long
/// as names can be.
Result<std::filesystem::path> unused_name_beside(const std::filesystem::path& target);

/// Flushes `finished` to the disk, renames it to `target` and flushes the folder.
Status replace_file(const std::filesystem::path& finished, const std::filesystem::path& target);

/// `-wal` and `-shm` of an SQLite file.
void remove_companions(const std::filesystem::path& path);

}  // namespace ygslam::map_file
