// Instance ids from PNG files: the stored values, never converted to colours.
#pragma once

#include <filesystem>

#include "core/result.hpp"
#include "image/image.hpp"

namespace ygslam {

/// Reads a grey or palette PNG of at most 8 bits; of a palette image the indices.
/// @return kInput with file and fault for anything else, also truncated or damaged files.
[[nodiscard]] Result<GreyImage> read_png_ids(const std::filesystem::path& file);

}  // namespace ygslam
