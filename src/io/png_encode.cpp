// Writes PNG (W3C PNG Specification, 3rd ed.): rows are predicted here, and libdeflate compresses
// the image as a whole, in half of zlib's time.
#include <libdeflate.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "io/png_codec.hpp"

namespace ygslam::png {
namespace {

using Row = std::span<const std::uint8_t>;

/// The filters of section 9.2, by their numbers.
enum FilterType : std::uint8_t { kNone, kSub, kUp, kAverage, kPaeth };
constexpr int kFilters = 5;

/// Section 9.4: whichever of left, above and upper left is nearest to left + above - upper left.
std::uint8_t paeth(int left, int above, int corner) {
  const int to_left = std::abs(above - corner);
  const int to_above = std::abs(left - corner);
  const int to_corner = std::abs(left + above - 2 * corner);
  if (to_left <= to_above && to_left <= to_corner) return static_cast<std::uint8_t>(left);
  return static_cast<std::uint8_t>(to_above <= to_corner ? above : corner);
}

/// @param step bytes of a pixel. @param out the type and the row as it differs from its prediction.
void predict(FilterType type, Row row, Row above, std::size_t step, std::uint8_t* out) {
  *out++ = type;
  const std::size_t n = row.size();
  const auto difference = [&](std::size_t from, std::size_t to, const auto& predicted) {
    for (std::size_t i = from; i < to; ++i)
      out[i] = static_cast<std::uint8_t>(row[i] - predicted(i));
  };
  const auto nothing = [](std::size_t) { return 0; };
  switch (type) {
    case kNone:
      std::copy(row.begin(), row.end(), out);
      break;
    case kSub:
      difference(0, step, nothing);
      difference(step, n, [&](std::size_t i) { return row[i - step]; });
      break;
    case kUp:
      difference(0, n, [&](std::size_t i) { return above[i]; });
      break;
    case kAverage:
      difference(0, step, [&](std::size_t i) { return above[i] / 2; });
      difference(step, n, [&](std::size_t i) { return (row[i - step] + above[i]) / 2; });
      break;
    case kPaeth:
      difference(0, step, [&](std::size_t i) { return above[i]; });
      difference(step, n,
                 [&](std::size_t i) { return paeth(row[i - step], above[i], above[i - step]); });
      break;
  }
}

/// Section 12.7: of all filters that whose differences, taken as signed, have the smallest sum.
void predict_best(Row row, Row above, std::size_t step, std::uint8_t* out) {
  std::vector<std::uint8_t> trial(row.size() + 1);
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  for (int type = 0; type < kFilters; ++type) {
    predict(static_cast<FilterType>(type), row, above, step, trial.data());
    std::int64_t sum = 0;
    for (std::size_t i = 1; i < trial.size(); ++i)
      sum += std::abs(static_cast<int>(static_cast<std::int8_t>(trial[i])));
    if (sum >= least) continue;
    least = sum;
    std::copy(trial.begin(), trial.end(), out);
  }
}

/// All rows as they are compressed: each predicted, with its filter's number in front.
std::vector<std::uint8_t> predicted_rows(const std::uint8_t* pixels, const ImageHeader& header,
                                         PngFilter filter) {
  const std::size_t step = static_cast<std::size_t>(header.channels) * header.bits / 8;
  const std::size_t stride = step * header.size.width;
  std::vector<std::uint8_t> lines((stride + 1) * header.size.height);
  std::vector<std::uint8_t> row(stride), above(stride);
  for (int v = 0; v < header.size.height; ++v) {
    std::memcpy(row.data(), pixels + v * stride, stride);
    if (std::endian::native == std::endian::little && header.bits == 16) {
      for (std::size_t i = 0; i + 1 < stride; i += 2) std::swap(row[i], row[i + 1]);
    }
    std::uint8_t* const out = lines.data() + v * (stride + 1);
    if (filter == PngFilter::kBest) {
      predict_best(row, above, step, out);
    } else {
      predict(filter == PngFilter::kUp ? kUp : kNone, row, above, step, out);
    }
    row.swap(above);
  }
  return lines;
}

void append_number(std::string& bytes, std::size_t value) {
  for (int shift = 24; shift >= 0; shift -= 8)
    bytes.push_back(static_cast<char>(value >> shift & 0xffU));
}

/// Section 5.3: length, name, content, check sum of the last two.
void append_chunk(std::string& bytes, const char* name, std::string_view content) {
  append_number(bytes, content.size());
  const std::size_t begin = bytes.size();
  bytes.append(name).append(content);
  append_number(bytes, libdeflate_crc32(0, bytes.data() + begin, bytes.size() - begin));
}

}  // namespace

std::string encode(const std::uint8_t* pixels, const ImageHeader& header, int compression,
                   PngFilter filter) {
  const std::vector<std::uint8_t> lines = predicted_rows(pixels, header, filter);
  const std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor(
      libdeflate_alloc_compressor(compression), &libdeflate_free_compressor);
  CHECK(compressor != nullptr, "libdeflate: out of memory, or no such level");
  std::string packed(libdeflate_zlib_compress_bound(compressor.get(), lines.size()), '\0');
  packed.resize(libdeflate_zlib_compress(compressor.get(), lines.data(), lines.size(),
                                         packed.data(), packed.size()));
  CHECK(!packed.empty(), "libdeflate: more bytes than it said");

  constexpr std::uint8_t kGrey = 0, kColour = 2;
  std::string size;
  append_number(size, static_cast<std::size_t>(header.size.width));
  append_number(size, static_cast<std::size_t>(header.size.height));
  for (const int value : {header.bits, static_cast<int>(header.channels == 1 ? kGrey : kColour), 0,
                          0, 0})  // deflate, the filters above, rows in their order
    size.push_back(static_cast<char>(value));
  std::string bytes = "\x89PNG\r\n\x1a\n";
  append_chunk(bytes, "IHDR", size);
  append_chunk(bytes, "IDAT", packed);
  append_chunk(bytes, "IEND", {});
  return bytes;
}

}  // namespace ygslam::png
