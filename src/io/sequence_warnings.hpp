// What is odd about a sequence and may still be right: told, not refused.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "io/image_file.hpp"
#include "io/sequence.hpp"

namespace ygslam {

/// File and line of a camera value, as far as it has one.
[[nodiscard]] std::string camera_place(const Sequence& sequence, const std::string& key);

/// Where colour and depth belong together at another offset than the pairs have.
/// @param offset_ns as their stamps tell it.
void warn_of_offset(const std::optional<std::int64_t>& offset_ns, Sequence& sequence);
/// A principal point in a border of the image, or one that fits other images.
void warn_of_centre(Sequence& sequence);
/// Stamps that seem to be of another unit than seconds, and long gaps.
void warn_of_steps(Sequence& sequence);
/// Says what images are, where that is not 8-bit colour and 16-bit depth as most have it.
void note_kinds(const ImageHeader& colour, Sequence& sequence);

}  // namespace ygslam
