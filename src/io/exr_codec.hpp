// OpenEXR behind a plain interface: one channel of floats, which is what depth is.
#pragma once

#include <cstdint>
#include <string_view>

#include "core/result.hpp"
#include "io/image_file.hpp"

namespace ygslam::exr {

[[nodiscard]] bool has_signature(std::string_view bytes);
/// The only channel, or the one called Z, Y or depth. @return kInput where there is none such.
[[nodiscard]] Result<ImageHeader> header(std::string_view bytes);
/// @param pixels room for floats of 32 bits; half floats become such.
Status decode(std::string_view bytes, std::uint8_t* pixels);

}  // namespace ygslam::exr
