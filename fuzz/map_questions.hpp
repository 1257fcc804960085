// All that the program does with a map file of somebody else's.
#pragma once

#include <filesystem>

namespace ygslam::fuzz {

/// The answers must fit together, whatever the file. It may be changed: it is written to as well.
void ask_map_file(const std::filesystem::path& path);

}  // namespace ygslam::fuzz
