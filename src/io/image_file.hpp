// Images from and to files. Decoders refuse what is damaged or of another kind than asked for; they
// never convert silently and never allocate before the header has been found sane.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "image/depth.hpp"
#include "image/image.hpp"

namespace ygslam {

inline constexpr int kMaxImageSide_px = 16384;
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{64} << 20;

struct ImageSize {
  int width = 0, height = 0;  ///< [px]
  bool operator==(const ImageSize&) const = default;
};
/// As messages say it: "640x480".
[[nodiscard]] std::string shown_size(const ImageSize& size);

/// How a row is predicted from its surroundings: the best of all (slow), from itself, from above.
enum class PngFilter { kBest, kNone, kUp };

struct ImageHeader {
  ImageSize size;
  int channels = 0;  ///< 1 grey, 2 grey with alpha, 3 colour, 4 with alpha (or CMYK)
  int bits = 0;      ///< per channel
  bool palette = false;
  bool is_float = false;
  std::string_view format = "PNG";  ///< PNG, JPEG, TIFF, EXR, NumPy, PGM, PPM, PFM
};

/// "16-bit PGM", "float TIFF", "8-bit PNG with palette".
[[nodiscard]] std::string shown_kind(const ImageHeader& header);

// Every decoder takes a whole file in memory, told apart by content, and returns kInput with a
// short reason ("truncated JPEG", "other size: ..."); callers put the file's name in front.

/// Endings of the names of images that are read, in small letters.
[[nodiscard]] bool has_image_ending(const std::filesystem::path& name);

[[nodiscard]] Result<ImageHeader> decode_header(std::string_view bytes);
/// 8-bit colour, also with a palette or an alpha channel, which is left out; a grey image is
/// accepted where channels is 1 (r = g = b).
/// @param size if given, any other size is an error, found before anything is allocated.
[[nodiscard]] Result<ColourImage> decode_colour(std::string_view bytes,
                                                std::optional<ImageSize> size = {},
                                                int channels = 3);
/// 16-bit grey PNG, raw sensor values.
[[nodiscard]] Result<Image<std::uint16_t>> decode_depth(std::string_view bytes,
                                                        std::optional<ImageSize> size = {});
/// Depth as files keep it: PNG, PGM and TIFF of 16 bits in units of the sensor; TIFF, EXR, PFM and
/// NumPy of floats in metres, NumPy of uint16 in units.
/// @param scale units per metre. @return kInput, too, for floats that look like millimetres.
[[nodiscard]] Result<DepthImage> decode_depth_m(std::string_view bytes,
                                                std::optional<ImageSize> size, double scale,
                                                const DepthConfig& config);
/// 8-bit grey PNG (instance ids).
[[nodiscard]] Result<GreyImage> decode_grey(std::string_view bytes,
                                            std::optional<ImageSize> size = {});

/// Luma by ITU-R BT.601 in 14-bit integers: 0.299 r + 0.587 g + 0.114 b, rounded.
[[nodiscard]] GreyImage grey_from_colour(const ColourImage& colour);

/// @param compression zlib level 0 to 9. @param filter how a row is predicted before compression.
[[nodiscard]] std::string encode_png(const ColourImage& image, int compression = 3,
                                     PngFilter filter = PngFilter::kBest);
[[nodiscard]] std::string encode_png(const GreyImage& image, int compression = 3,
                                     PngFilter filter = PngFilter::kBest);
[[nodiscard]] std::string encode_png(const Image<std::uint16_t>& image, int compression = 3,
                                     PngFilter filter = PngFilter::kBest);
/// @param quality 1 to 100, chroma at half resolution as cameras write it.
[[nodiscard]] std::string encode_jpeg(const ColourImage& image, int quality = 90);

}  // namespace ygslam
