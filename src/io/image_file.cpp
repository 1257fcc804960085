#include "io/image_file.hpp"

#include <algorithm>
#include <string>

#include "io/jpeg_codec.hpp"
#include "io/png_codec.hpp"

namespace ygslam {
namespace {

static_assert(sizeof(Rgb8) == 3, "colour pixels are decoded in place");
using Bytes = std::string_view;

Error fault(std::string reason) { return {ErrorKind::kInput, std::move(reason)}; }

std::string kind_text(const ImageHeader& header) {
  return std::to_string(header.channels) + " channel(s) of " + std::to_string(header.bits) +
         " bit" + (header.palette ? ", palette" : "");
}

// The header, if it is of the kind asked for.
Result<ImageHeader> expect(Bytes bytes, std::optional<ImageSize> size, int channels, int bits) {
  auto header = decode_header(bytes);
  if (!header.ok()) return header;
  if (size && header->size != *size) {
    return fault("other size: " + shown_size(header->size) + ", expected " + shown_size(*size));
  }
  if (header->channels != channels || header->bits != bits || header->palette) {
    return fault("other format: " + kind_text(*header) + ", expected " +
                 kind_text({{}, channels, bits, false}));
  }
  return header;
}

template <typename T>
Result<Image<T>> decode_png_grey(Bytes bytes, std::optional<ImageSize> size) {
  const auto header = expect(bytes, size, 1, 8 * sizeof(T));
  if (!header.ok()) return header.error();
  if (!png::has_signature(bytes)) return fault("not a PNG file");
  Image<T> image(header->size.width, header->size.height);
  const Status done = png::decode(bytes, reinterpret_cast<std::uint8_t*>(image.data()));
  if (!done.ok()) return done.error();
  return image;
}

ColourImage colour_from_grey(const GreyImage& grey) {
  ColourImage colour(grey.width(), grey.height());
  std::transform(grey.begin(), grey.end(), colour.begin(), [](std::uint8_t value) {
    return Rgb8{value, value, value};
  });
  return colour;
}

}  // namespace

std::string shown_size(const ImageSize& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

Result<ImageHeader> decode_header(Bytes bytes) {
  if (bytes.empty()) return fault("empty file");
  const bool is_png = png::has_signature(bytes);
  if (!is_png && !jpeg::has_signature(bytes)) return fault("neither JPEG nor PNG");
  auto header = is_png ? png::header(bytes) : jpeg::header(bytes);
  if (!header.ok()) return header;
  const ImageSize& size = header->size;
  if (size.width < 1 || size.height < 1 || size.width > kMaxImageSide_px ||
      size.height > kMaxImageSide_px || std::int64_t{size.width} * size.height > kMaxImagePixels) {
    return fault("absurd size: " + shown_size(size));
  }
  return header;
}

Result<ColourImage> decode_colour(Bytes bytes, std::optional<ImageSize> size, int channels) {
  const auto header = expect(bytes, size, channels, 8);
  if (!header.ok()) return header.error();
  if (png::has_signature(bytes) && channels == 1) {
    const auto grey = decode_grey(bytes, size);
    if (!grey.ok()) return grey.error();
    return colour_from_grey(*grey);
  }
  ColourImage image(header->size.width, header->size.height);
  auto* pixels = reinterpret_cast<std::uint8_t*>(image.data());
  const Status done = png::has_signature(bytes) ? png::decode(bytes, pixels)
                                                : jpeg::decode(bytes, pixels, header->size);
  if (!done.ok()) return done.error();
  return image;
}

Result<Image<std::uint16_t>> decode_depth(Bytes bytes, std::optional<ImageSize> size) {
  return decode_png_grey<std::uint16_t>(bytes, size);
}

Result<GreyImage> decode_grey(Bytes bytes, std::optional<ImageSize> size) {
  return decode_png_grey<std::uint8_t>(bytes, size);
}

GreyImage grey_from_colour(const ColourImage& colour) {
  GreyImage grey(colour.width(), colour.height());
  std::transform(colour.begin(), colour.end(), grey.begin(), [](const Rgb8& pixel) {
    return static_cast<std::uint8_t>((4899 * pixel.r + 9617 * pixel.g + 1868 * pixel.b + 8192) >>
                                     14);
  });
  return grey;
}

std::string encode_png(const ColourImage& image, int compression, PngFilter filter) {
  return png::encode(reinterpret_cast<const std::uint8_t*>(image.data()),
                     {{image.width(), image.height()}, 3, 8, false}, compression, filter);
}

std::string encode_png(const GreyImage& image, int compression, PngFilter filter) {
  return png::encode(image.data(), {{image.width(), image.height()}, 1, 8, false}, compression,
                     filter);
}

std::string encode_png(const Image<std::uint16_t>& image, int compression, PngFilter filter) {
  return png::encode(reinterpret_cast<const std::uint8_t*>(image.data()),
                     {{image.width(), image.height()}, 1, 16, false}, compression, filter);
}

std::string encode_jpeg(const ColourImage& image, int quality) {
  return jpeg::encode(reinterpret_cast<const std::uint8_t*>(image.data()),
                      {image.width(), image.height()}, quality);
}

}  // namespace ygslam
