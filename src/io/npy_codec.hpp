// NumPy's .npy: one array (numpy.lib.format), as images of one channel.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/result.hpp"
#include "io/image_file.hpp"

namespace ygslam::npy {

[[nodiscard]] bool has_signature(std::string_view bytes);
/// Arrays of H x W, H x W x 1 or 1 x H x W, rows first, of uint8, uint16, float16, float32,
/// float64.
[[nodiscard]] Result<ImageHeader> header(std::string_view bytes);
/// @param pixels room for what header() told; all floats become those of 32 bits.
Status decode(std::string_view bytes, std::uint8_t* pixels);

}  // namespace ygslam::npy
