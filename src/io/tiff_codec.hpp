// TIFF behind a plain interface: libtiff stays in one file.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/result.hpp"
#include "io/image_file.hpp"

namespace ygslam::tiff {

[[nodiscard]] bool has_signature(std::string_view bytes);
/// The first and only page: 8 or 16 bits, or 32- or 64-bit floats, in strips, channels side by
/// side.
[[nodiscard]] Result<ImageHeader> header(std::string_view bytes);
/// @param pixels room for what header() told; floats of 64 bits become 32.
Status decode(std::string_view bytes, std::uint8_t* pixels);

}  // namespace ygslam::tiff
