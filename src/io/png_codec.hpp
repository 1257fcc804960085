// PNG behind a plain interface: libpng's setjmp stays in one file.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "io/image_file.hpp"

namespace ygslam::png {

[[nodiscard]] bool has_signature(std::string_view bytes);
[[nodiscard]] Result<ImageHeader> header(std::string_view bytes);
/// Decodes into `pixels`, rows without padding, 16-bit samples in machine order, no conversion but
/// of palettes to r, g, b and of grey with fewer than 8 bits to 8. @param pixels room for the size,
/// channels and bits that header() told, at least a byte each; of a palette for 3 channels.
Status decode(std::string_view bytes, std::uint8_t* pixels);
/// @param pixels rows without padding, 16-bit samples in machine order.
[[nodiscard]] std::string encode(const std::uint8_t* pixels, const ImageHeader& header,
                                 int compression, PngFilter filter);

}  // namespace ygslam::png
