// The fast way to the pixels of most PNG files: libdeflate, and words of samples.
#pragma once

#include <cstdint>
#include <string_view>

#include "io/image_file.hpp"

namespace ygslam::png {

/// As png::decode, for grey and colour of at most four bytes a pixel, without palette, not
/// interlaced, whose check sums are right.
/// @param header of these bytes, as libpng read it.
/// @return false: the file is another one, or damaged; libpng must say which.
[[nodiscard]] bool decode_plain(std::string_view bytes, const ImageHeader& header,
                                std::uint8_t* pixels);

}  // namespace ygslam::png
