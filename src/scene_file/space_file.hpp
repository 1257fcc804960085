// Observed space as files: OctoMap's trees.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// OctoMap's `.bt` (OcTree): free and occupied cells, no more. What is in no cell stays unknown.
/// @return kOutput naming the file; also where a cell's index does not fit in 16 bits.
Status write_octomap_bt(const std::filesystem::path& path, const SpaceCells& space);

/// OctoMap's `.ot` (ColorOcTree): with log-odds, and occupied cells in the colour of their class
/// (as labels.json has it).
/// @return as write_octomap_bt.
Status write_octomap_ot(const std::filesystem::path& path, const SpaceCells& space);

}  // namespace ygslam
