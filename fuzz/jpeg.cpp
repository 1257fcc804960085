#include "core/check.hpp"
#include "fuzz/targets.hpp"
#include "io/image_file.hpp"

namespace ygslam::fuzz {

void jpeg(std::string_view bytes) {
  const auto header = decode_header(bytes);
  if (!header.ok() || header->size.width * std::int64_t{1} * header->size.height > 1 << 20) return;
  for (const int channels : {1, 3}) {
    const auto image = decode_colour(bytes, {}, channels);
    if (!image.ok()) continue;
    CHECK(image->width() == header->size.width && image->height() == header->size.height);
    CHECK(!decode_colour(bytes, ImageSize{image->width() + 1, 1}, channels).ok());
  }
}

}  // namespace ygslam::fuzz
