// RVL, the run-length code of depth images (Wilson, "Fast Lossless Depth Image Compression", 2017).
#pragma once

#include <cstdint>
#include <span>

#include "core/result.hpp"
#include "image/image.hpp"
#include "io/image_file.hpp"

namespace ygslam {

/// @param bytes the code, behind what tells the size. @return kInput with a reason alone: it ends
/// early, or says more pixels than the image has.
[[nodiscard]] Result<Image<std::uint16_t>> decode_rvl(std::span<const std::uint8_t> bytes,
                                                      const ImageSize& size);

}  // namespace ygslam
