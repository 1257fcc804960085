// The portable any-maps of Netpbm: PGM (P5), PPM (P6), and PFM (Pf) with floats.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/result.hpp"
#include "io/image_file.hpp"

namespace ygslam::pnm {

[[nodiscard]] bool has_signature(std::string_view bytes);
[[nodiscard]] Result<ImageHeader> header(std::string_view bytes);
/// @param pixels room for what header() told; 16-bit samples in machine order.
Status decode(std::string_view bytes, std::uint8_t* pixels);

}  // namespace ygslam::pnm
