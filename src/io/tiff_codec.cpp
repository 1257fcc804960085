#include "io/tiff_codec.hpp"

#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

namespace ygslam::tiff {
namespace {

constexpr tmsize_t kMostBytesAtOnce = tmsize_t{1} << 29;  // a strip of the largest image

Error tiff_fault(std::string reason) { return {ErrorKind::kInput, std::move(reason)}; }

/// Bytes in memory as libtiff's file.
struct Source {
  std::string_view bytes;
  std::uint64_t at = 0;
  std::string fault;
};
Source& source_of(thandle_t handle) { return *static_cast<Source*>(handle); }

tmsize_t read_bytes(thandle_t handle, void* out, tmsize_t count) {
  Source& source = source_of(handle);
  if (count <= 0 || source.at >= source.bytes.size()) return 0;
  const auto n =
      std::min<std::uint64_t>(static_cast<std::uint64_t>(count), source.bytes.size() - source.at);
  std::memcpy(out, source.bytes.data() + source.at, n);
  source.at += n;
  return static_cast<tmsize_t>(n);
}
tmsize_t write_bytes(thandle_t /*handle*/, void* /*bytes*/, tmsize_t /*count*/) { return 0; }
toff_t seek_to(thandle_t handle, toff_t offset, int whence) {
  Source& source = source_of(handle);
  const std::uint64_t base = whence == SEEK_SET   ? 0
                             : whence == SEEK_CUR ? source.at
                                                  : source.bytes.size();
  return source.at = base + offset;
}
int close_source(thandle_t /*handle*/) { return 0; }
toff_t size_of_source(thandle_t handle) { return source_of(handle).bytes.size(); }

int keep_fault(TIFF* /*tiff*/, void* user, const char* /*module*/, const char* format,
               va_list arguments) {
  std::array<char, 120> text{};
  std::vsnprintf(text.data(), text.size(), format, arguments);
  auto& fault = static_cast<Source*>(user)->fault;
  if (fault.empty()) fault = text.data();
  return 1;
}
int ignore_warning(TIFF* /*tiff*/, void* /*user*/, const char* /*module*/, const char* /*format*/,
                   va_list /*arguments*/) {
  return 1;
}

struct Close {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using Handle = std::unique_ptr<TIFF, Close>;

Handle open(Source& source) {
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(
      TIFFOpenOptionsAlloc(), TIFFOpenOptionsFree);
  if (!options) throw std::bad_alloc();
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), kMostBytesAtOnce);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_fault, &source);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore_warning, nullptr);
  return Handle(TIFFClientOpenExt("TIFF", "rm", &source, read_bytes, write_bytes, seek_to,
                                  close_source, size_of_source, nullptr, nullptr, options.get()));
}

Error corrupt(const Source& source) {
  return tiff_fault("corrupt or truncated TIFF (" + source.fault + ")");
}

/// A field of 16 bits; what the file does not say is what the standard says.
std::uint16_t field(TIFF* tiff, ttag_t tag) {
  std::uint16_t value = 0;
  TIFFGetFieldDefaulted(tiff, tag, &value);
  return value;
}

/// What of a TIFF file is not read; empty where it is read.
std::string refusal(TIFF* tiff, int channels, int bits, std::uint16_t sample_format) {
  if (TIFFIsTiled(tiff) != 0) return "a TIFF file of tiles is not read, of strips it is";
  if (TIFFLastDirectory(tiff) == 0) return "a TIFF file of several pages is not read";
  if (channels > 1 && field(tiff, TIFFTAG_PLANARCONFIG) != PLANARCONFIG_CONTIG)
    return "a TIFF file with separate planes is not read";
  const std::uint16_t photometric = field(tiff, TIFFTAG_PHOTOMETRIC);
  if (photometric != (channels < 3 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB))
    return "a TIFF file of photometric kind " + std::to_string(photometric) + " is not read";
  const bool is_whole = sample_format == SAMPLEFORMAT_UINT && (bits == 8 || bits == 16);
  const bool is_float = sample_format == SAMPLEFORMAT_IEEEFP && (bits == 32 || bits == 64);
  if (!is_whole && !is_float)
    return "a TIFF file with samples of format " + std::to_string(sample_format) + " and " +
           std::to_string(bits) + " bits is not read";
  return {};
}

Result<ImageHeader> header_of(TIFF* tiff) {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &height);
  const int bits = field(tiff, TIFFTAG_BITSPERSAMPLE);
  const int channels = field(tiff, TIFFTAG_SAMPLESPERPIXEL);
  const std::uint16_t sample_format = field(tiff, TIFFTAG_SAMPLEFORMAT);
  if (std::string wrong = refusal(tiff, channels, bits, sample_format); !wrong.empty())
    return tiff_fault(std::move(wrong));
  ImageHeader header;
  constexpr std::uint32_t kTooMuch = kMaxImageSide_px + 1;
  header.size = {static_cast<int>(std::min(width, kTooMuch)),
                 static_cast<int>(std::min(height, kTooMuch))};
  header.channels = channels;
  header.is_float = sample_format == SAMPLEFORMAT_IEEEFP;
  header.bits = header.is_float ? 32 : bits;
  header.format = "TIFF";
  return header;
}

}  // namespace

bool has_signature(std::string_view bytes) {
  using namespace std::string_view_literals;
  return bytes.starts_with("II*\0"sv) || bytes.starts_with("MM\0*"sv) ||
         bytes.starts_with("II+\0"sv) || bytes.starts_with("MM\0+"sv);
}

Result<ImageHeader> header(std::string_view bytes) {
  Source source{bytes, 0, {}};
  const Handle tiff = open(source);
  if (!tiff) return corrupt(source);
  return header_of(tiff.get());
}

Status decode(std::string_view bytes, std::uint8_t* pixels) {
  Source source{bytes, 0, {}};
  const Handle tiff = open(source);
  if (!tiff) return corrupt(source);
  const auto header = header_of(tiff.get());
  if (!header.ok()) return header.error();
  const bool halves = field(tiff.get(), TIFFTAG_BITSPERSAMPLE) == 64;
  const auto samples = static_cast<std::size_t>(header->size.width) * header->channels;
  const std::size_t row_bytes = samples * (header->bits / 8);
  const std::size_t stored_bytes = halves ? 2 * row_bytes : row_bytes;
  if (TIFFScanlineSize64(tiff.get()) != stored_bytes) return corrupt(source);
  std::vector<std::uint8_t> row(stored_bytes);
  for (int v = 0; v < header->size.height; ++v, pixels += row_bytes) {
    if (TIFFReadScanline(tiff.get(), row.data(), static_cast<std::uint32_t>(v), 0) != 1)
      return corrupt(source);
    if (!halves) std::memcpy(pixels, row.data(), row_bytes);
    for (std::size_t i = 0; halves && i < samples; ++i) {
      double value = 0;
      std::memcpy(&value, row.data() + i * sizeof value, sizeof value);
      const auto single = static_cast<float>(value);
      std::memcpy(pixels + i * sizeof single, &single, sizeof single);
    }
  }
  return Ok{};
}

}  // namespace ygslam::tiff
