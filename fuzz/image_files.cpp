#include <cmath>

#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/image_file.hpp"

namespace ygslam::fuzz {

/// Depth and colour in TIFF, EXR, NumPy, PGM, PPM and PFM: what is accepted has the size that its
/// header told, and depth is in range or none.
void image_files(std::string_view bytes) {
  const auto header = decode_header(bytes);
  if (!header.ok()) {
    CHECK(header.error().message.find('\n') == std::string::npos, "a fault is one line");
    return;
  }
  CHECK(!shown_kind(*header).empty());
  if (std::int64_t{header->size.width} * header->size.height > 1 << 20) return;
  const auto depth_m = decode_depth_m(bytes, header->size, 1000, {});
  if (depth_m.ok()) {
    CHECK(depth_m->width() == header->size.width && depth_m->height() == header->size.height);
    for (const float d : *depth_m) CHECK(d == 0 || (d >= 0.3F && d <= 8), "in range or none");
  }
  for (const int channels : {1, 3}) {
    const auto colour = decode_colour(bytes, header->size, channels);
    if (colour.ok()) CHECK(colour->width() == header->size.width);
  }
}

}  // namespace ygslam::fuzz
