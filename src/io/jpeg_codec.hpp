// JPEG through libturbojpeg, with damage treated as damage (OpenCV's imread returns grey areas).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "io/image_file.hpp"

namespace ygslam::jpeg {

[[nodiscard]] bool has_signature(std::string_view bytes);
[[nodiscard]] Result<ImageHeader> header(std::string_view bytes);
/// Decodes to r, g, b. @param pixels room for width x height x 3 as told by header().
/// @return kInput if the file has no end marker or the decoder had to guess anything.
Status decode(std::string_view bytes, std::uint8_t* pixels);
[[nodiscard]] std::string encode(const std::uint8_t* rgb, const ImageSize& size, int quality);

}  // namespace ygslam::jpeg
