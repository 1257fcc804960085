#include "io/image_file.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include "core/statistics.hpp"
#include "io/exr_codec.hpp"
#include "io/jpeg_codec.hpp"
#include "io/npy_codec.hpp"
#include "io/png_codec.hpp"
#include "io/pnm_codec.hpp"
#include "io/tiff_codec.hpp"

namespace ygslam {
namespace {

static_assert(sizeof(Rgb8) == 3, "colour pixels are decoded in place");
using Bytes = std::string_view;

Error fault(std::string reason) { return {ErrorKind::kInput, std::move(reason)}; }

/// A kind of file.
struct Codec {
  bool (*has_signature)(Bytes);
  Result<ImageHeader> (*header)(Bytes);
  Status (*decode)(Bytes, std::uint8_t*);
};
constexpr std::array<Codec, 6> kCodecs = {{{png::has_signature, png::header, png::decode},
                                           {jpeg::has_signature, jpeg::header, jpeg::decode},
                                           {tiff::has_signature, tiff::header, tiff::decode},
                                           {exr::has_signature, exr::header, exr::decode},
                                           {npy::has_signature, npy::header, npy::decode},
                                           {pnm::has_signature, pnm::header, pnm::decode}}};

const Codec* codec_of(Bytes bytes) {
  const auto* codec = std::find_if(kCodecs.begin(), kCodecs.end(),
                                   [&](const Codec& known) { return known.has_signature(bytes); });
  return codec == kCodecs.end() ? nullptr : codec;
}

/// What a file is that nobody here reads.
std::string unread_kind(Bytes bytes) {
  using namespace std::string_view_literals;
  constexpr std::string_view kRead = "; read are JPEG, PNG, TIFF, EXR, PGM, PPM, PFM and NumPy";
  for (const auto& [start, name] :
       {std::pair<Bytes, Bytes>{"BM", "BMP"},
        {"version https://git-lfs", "pointer of Git LFS (git lfs pull)"},
        {"<", "text in HTML or XML"},
        {"\x1F\x8B", "file compressed with gzip"},
        {"\0\0\0\x0CjP"sv, "JPEG 2000"},
        {"P1", "PBM"},
        {"P3", "PPM as text"},
        {"P4", "PBM"},
        {"GIF8", "GIF"},
        {"RIFF", "WebP"},
        {"PF", "PFM with colour"},
        {"P2", "PGM as text"},
        {"PK", "zip archive (npz?)"}})
    if (bytes.starts_with(start)) return "is a " + std::string(name) + std::string(kRead);
  if (bytes.size() > 8 && bytes.substr(4, 4) == "ftyp")
    return "is HEIF, AVIF or MP4" + std::string(kRead);
  return "neither JPEG nor PNG, nor another format that is read";
}

std::string kind_text(const ImageHeader& header) {
  return std::to_string(header.channels) + " channel(s) of " + std::to_string(header.bits) +
         " bit" + (header.palette ? ", palette" : "") + (header.is_float ? ", float" : "");
}

Error other_format(const ImageHeader& header, const std::string& expected) {
  return fault("other format: " + kind_text(header) + ", expected " + expected);
}

// The header, if the image has the size asked for.
Result<ImageHeader> header_of_size(Bytes bytes, std::optional<ImageSize> size) {
  auto header = decode_header(bytes);
  if (header.ok() && size && header->size != *size)
    return fault("other size: " + shown_size(header->size) + ", expected " + shown_size(*size));
  return header;
}

// The header, if it is of the kind asked for.
Result<ImageHeader> expect(Bytes bytes, std::optional<ImageSize> size, int channels, int bits) {
  auto header = header_of_size(bytes, size);
  if (!header.ok()) return header;
  if (header->channels != channels || header->bits != bits || header->palette || header->is_float)
    return other_format(*header, kind_text({{}, channels, bits, false}));
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

template <typename T>
Result<Image<T>> decode_samples(Bytes bytes, const ImageHeader& header) {
  Image<T> image(header.size.width, header.size.height);
  const Status done = codec_of(bytes)->decode(bytes, reinterpret_cast<std::uint8_t*>(image.data()));
  if (!done.ok()) return done.error();
  return image;
}

/// Floats are metres; those of which none is a distance in a room, but many a thousand times that,
/// are millimetres.
Status check_metres(const DepthImage& stored, const DepthImage& depth_m) {
  constexpr float kBeyondRooms_m = 100;
  if (std::any_of(depth_m.begin(), depth_m.end(), [](float d) { return d > 0; })) return Ok{};
  std::vector<float> far;
  std::copy_if(stored.begin(), stored.end(), std::back_inserter(far),
               [](float d) { return std::isfinite(d) && d > kBeyondRooms_m; });
  if (2 * far.size() < stored.size()) return Ok{};
  return fault("float depth of about " + std::to_string(std::lround(median(std::move(far)))) +
               ": metres are expected; are these millimetres?");
}

ColourImage colour_from_grey(const GreyImage& grey) {
  ColourImage colour(grey.width(), grey.height());
  std::transform(grey.begin(), grey.end(), colour.begin(), [](std::uint8_t value) {
    return Rgb8{value, value, value};
  });
  return colour;
}

Result<ColourImage> without_alpha(Bytes bytes, const ImageHeader& header) {
  const auto channels = static_cast<std::size_t>(header.channels);
  ColourImage image(header.size.width, header.size.height);
  std::vector<std::uint8_t> samples(image.size() * channels);
  const Status done = codec_of(bytes)->decode(bytes, samples.data());
  if (!done.ok()) return done.error();
  for (std::size_t i = 0; i < image.size(); ++i) {
    const std::uint8_t* pixel = samples.data() + i * channels;
    image.data()[i] =
        channels == 2 ? Rgb8{pixel[0], pixel[0], pixel[0]} : Rgb8{pixel[0], pixel[1], pixel[2]};
  }
  return image;
}

}  // namespace

std::string shown_kind(const ImageHeader& header) {
  const std::string bits = header.is_float ? "float" : std::to_string(header.bits) + "-bit";
  const std::string channels = header.palette ? " with a palette"
                               : header.channels > 1
                                   ? " with " + std::to_string(header.channels) + " channels"
                                   : "";
  return bits + " " + std::string(header.format) + channels;
}

bool has_image_ending(const std::filesystem::path& name) {
  constexpr std::array<std::string_view, 10> kEndings = {".png", ".jpg", ".jpeg", ".pgm", ".ppm",
                                                         ".pfm", ".tif", ".tiff", ".exr", ".npy"};
  std::string ending = name.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

std::string shown_size(const ImageSize& size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

Result<ImageHeader> decode_header(Bytes bytes) {
  if (bytes.empty()) return fault("empty file");
  const Codec* const codec = codec_of(bytes);
  if (codec == nullptr) return fault(unread_kind(bytes));
  auto header = codec->header(bytes);
  if (!header.ok()) return header;
  const ImageSize& size = header->size;
  if (size.width < 1 || size.height < 1 || size.width > kMaxImageSide_px ||
      size.height > kMaxImageSide_px || std::int64_t{size.width} * size.height > kMaxImagePixels) {
    return fault("absurd size: " + shown_size(size));
  }
  return header;
}

Result<ColourImage> decode_colour(Bytes bytes, std::optional<ImageSize> size, int channels) {
  const auto header = header_of_size(bytes, size);
  if (!header.ok()) return header.error();
  const int stored = header->palette ? 3 : header->channels;
  const bool is_jpeg = header->format == "JPEG";  // which has no alpha, but may be CMYK
  const bool is_fitting = stored == channels || (stored == channels + 1 && !is_jpeg);
  // Grey of fewer bits is a mask, or a picture for print.
  const bool is_8_bit = header->bits == 8 || (header->palette && header->bits < 8);
  if (!is_8_bit || header->is_float || !is_fitting)
    return other_format(*header, kind_text({{}, channels, 8, false}));
  if (is_jpeg) return decode_samples<Rgb8>(bytes, *header);  // also where it is grey
  if (stored == 1) {
    const auto grey = decode_samples<std::uint8_t>(bytes, *header);
    if (!grey.ok()) return grey.error();
    return colour_from_grey(*grey);
  }
  if (stored == 3) return decode_samples<Rgb8>(bytes, *header);
  return without_alpha(bytes, *header);
}

Result<DepthImage> decode_depth_m(Bytes bytes, std::optional<ImageSize> size, double scale,
                                  const DepthConfig& config) {
  const auto header = header_of_size(bytes, size);
  if (!header.ok()) return header.error();
  const bool is_read = header->channels == 1 && !header->palette &&
                       (header->is_float ? header->bits == 32 : header->bits == 16);
  if (!is_read) return other_format(*header, kind_text({{}, 1, 16, false}) + ", or one of floats");
  if (!header->is_float) {
    const auto raw = decode_samples<std::uint16_t>(bytes, *header);
    if (!raw.ok()) return raw.error();
    if (has_swapped_bytes(*raw))
      return fault("16-bit depth with its bytes swapped (neighbours jump by 256s): a " +
                   std::string(header->format) +
                   (header->format == "PNG" || header->format == "PGM"
                        ? " has the high byte first"
                        : " says which byte comes first"));
    return depth_from_raw(*raw, scale, config);
  }
  const auto stored = decode_samples<float>(bytes, *header);
  if (!stored.ok()) return stored.error();
  DepthImage depth_m = sanitized_depth(*stored, config);
  if (Status metres = check_metres(*stored, depth_m); !metres.ok()) return metres.error();
  return depth_m;
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
