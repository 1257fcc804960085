#include "io/plain_png.hpp"

#include <libdeflate.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ygslam::png {
namespace {

constexpr std::size_t kSignature = 8;
constexpr std::size_t kAround = 12;  // length and type before a chunk's content, check sum after

std::uint32_t u32(std::string_view bytes) {
  std::uint32_t number = 0;
  for (const char byte : bytes.substr(0, 4))
    number = number << 8U | static_cast<std::uint8_t>(byte);
  return number;
}

/// Texts, colour profiles: libpng does not look at them either.
bool is_of_no_interest(std::string_view type, std::size_t length) {
  const auto is_small = [](char c) { return c >= 'a' && c <= 'z'; };
  const auto is_letter = [&](char c) { return is_small(c) || (c >= 'A' && c <= 'Z'); };
  return is_small(type[0]) && std::ranges::all_of(type, is_letter) && type != "tRNS" &&
         length < std::size_t{1} << 20U;
}

/// What the IDAT chunks contain; nothing where a chunk is damaged or changes what pixels mean.
std::optional<std::string> compressed_pixels(std::string_view rest) {
  std::string pixels;
  bool is_over = false;
  std::string_view type;
  for (rest.remove_prefix(kSignature); type != "IEND";) {
    if (rest.size() < kAround) return std::nullopt;
    const std::size_t length = u32(rest);
    if (length > rest.size() - kAround) return std::nullopt;
    const std::string_view named = rest.substr(4, 4 + length);
    if (libdeflate_crc32(0, named.data(), named.size()) != u32(rest.substr(8 + length)))
      return std::nullopt;
    const bool is_first = type.empty();
    type = named.substr(0, 4);
    is_over |= !pixels.empty() && type != "IDAT";
    if (type == "IDAT") {
      if (is_over) return std::nullopt;
      pixels += named.substr(4);
    } else if (!(type == "IEND" && length == 0) && !(type == "IHDR" && is_first) &&
               !is_of_no_interest(type, length)) {
      return std::nullopt;
    }
    rest.remove_prefix(kAround + length);
  }
  return pixels;
}

struct Free {
  void operator()(libdeflate_decompressor* decompressor) const {
    libdeflate_free_decompressor(decompressor);
  }
};

/// @return whether it is all of `compressed` that gives all of `room`.
bool inflate(std::string_view compressed, std::uint8_t* room, std::size_t bytes) {
  // Of another window zlib would check the distances, and libdeflate does not.
  if (!compressed.starts_with('\x78')) return false;
  const std::unique_ptr<libdeflate_decompressor, Free> decompressor(
      libdeflate_alloc_decompressor());
  if (!decompressor) throw std::bad_alloc();
  std::size_t used = 0;
  return libdeflate_zlib_decompress_ex(decompressor.get(), compressed.data(), compressed.size(),
                                       room, bytes, &used, nullptr) == LIBDEFLATE_SUCCESS &&
         used == compressed.size();
}

// The samples of one pixel side by side; at most four of them count.
using Samples = std::int16_t __attribute__((vector_size(16)));
using Bytes = std::uint8_t __attribute__((vector_size(8)));
constexpr std::size_t kWord = 4;  // bytes that are read and written at once

Samples load(const std::uint8_t* from) {
  Bytes word{};
  std::memcpy(&word, from, kWord);
  return __builtin_convertvector(word, Samples);
}
void store(std::uint8_t* to, Samples samples, std::size_t bytes) {
  const Bytes word = __builtin_convertvector(samples, Bytes);
  std::memcpy(to, &word, bytes);
}
Samples absolute(Samples x) { return x < 0 ? -x : x; }
Samples smaller(Samples x, Samples y) { return x < y ? x : y; }

// How a sample is predicted from the one before it, the one above, and the one before that.
// PNG, 3rd edition, section 9.2.
Samples from_before(Samples before, Samples /*above*/, Samples /*corner*/) { return before; }
Samples from_mean(Samples before, Samples above, Samples /*corner*/) {
  return (before + above) >> 1;
}
Samples by_paeth(Samples before, Samples above, Samples corner) {
  const Samples to_before = above - corner, to_above = before - corner;
  const Samples off_before = absolute(to_before), off_above = absolute(to_above);
  const Samples least = smaller(smaller(off_before, off_above), absolute(to_before + to_above));
  return least == off_before ? before : least == off_above ? above : corner;
}

/// Reads up to three bytes beyond both rows (of the one above, into its own row), and never writes
/// beyond its own.
template <std::size_t kBytes, Samples (*kPredicted)(Samples, Samples, Samples)>
void undo_row(const std::uint8_t* filtered, const std::uint8_t* above, std::uint8_t* row,
              std::size_t bytes) {
  Samples before{}, corner{};
  for (std::size_t i = 0; i < bytes; i += kBytes) {
    const Samples over = load(above + i);
    before = (load(filtered + i) + kPredicted(before, over, corner)) & 255;
    corner = over;
    store(row + i, before, i + kWord <= bytes ? kWord : kBytes);
  }
}

/// @return false: there is no such filter.
template <std::size_t kBytes>
bool undo_filter(int filter, const std::uint8_t* filtered, const std::uint8_t* above,
                 std::uint8_t* row, std::size_t bytes) {
  switch (filter) {
    case 0:
      std::memcpy(row, filtered, bytes);
      return true;
    case 1:
      undo_row<kBytes, from_before>(filtered, above, row, bytes);
      return true;
    case 2:
      std::transform(filtered, filtered + bytes, above, row, [](std::uint8_t a, std::uint8_t b) {
        return static_cast<std::uint8_t>(a + b);
      });
      return true;
    case 3:
      undo_row<kBytes, from_mean>(filtered, above, row, bytes);
      return true;
    case 4:
      undo_row<kBytes, by_paeth>(filtered, above, row, bytes);
      return true;
    default:
      return false;
  }
}

/// @param filtered rows behind the numbers of their filters, and room for a word.
template <std::size_t kBytes>
bool undo_filters(const std::uint8_t* filtered, std::size_t row_bytes, std::size_t rows,
                  std::uint8_t* pixels) {
  const std::vector<std::uint8_t> nothing(row_bytes + kWord);
  const std::uint8_t* above = nothing.data();
  for (std::size_t v = 0; v < rows; ++v, filtered += row_bytes, pixels += row_bytes) {
    const int filter = *filtered++;
    if (!undo_filter<kBytes>(filter, filtered, above, pixels, row_bytes)) return false;
    above = pixels;
  }
  return true;
}

bool undo_filters_of(std::size_t pixel_bytes, const std::uint8_t* filtered, std::size_t row_bytes,
                     std::size_t rows, std::uint8_t* pixels) {
  switch (pixel_bytes) {
    case 1:
      return undo_filters<1>(filtered, row_bytes, rows, pixels);
    case 2:
      return undo_filters<2>(filtered, row_bytes, rows, pixels);
    case 3:
      return undo_filters<3>(filtered, row_bytes, rows, pixels);
    default:
      return undo_filters<4>(filtered, row_bytes, rows, pixels);
  }
}

}  // namespace

bool decode_plain(std::string_view bytes, const ImageHeader& header, std::uint8_t* pixels) {
  constexpr std::size_t kInterlacePlace = 28;
  const auto pixel_bytes = static_cast<std::size_t>(header.channels * header.bits / 8);
  if (header.palette || header.bits < 8 || pixel_bytes > kWord || bytes[kInterlacePlace] != 0)
    return false;
  const std::size_t row_bytes = static_cast<std::size_t>(header.size.width) * pixel_bytes;
  if (row_bytes < kWord) return false;  // rows are read in words
  const auto rows = static_cast<std::size_t>(header.size.height);
  const auto compressed = compressed_pixels(bytes);
  if (!compressed) return false;
  const std::size_t filtered_bytes = rows * (row_bytes + 1);
  const auto filtered = std::make_unique_for_overwrite<std::uint8_t[]>(filtered_bytes + kWord);
  if (!inflate(*compressed, filtered.get(), filtered_bytes) ||
      !undo_filters_of(pixel_bytes, filtered.get(), row_bytes, rows, pixels))
    return false;
  if (std::endian::native == std::endian::little && header.bits == 16)
    for (std::size_t i = 0; i < rows * row_bytes; i += 2) std::swap(pixels[i], pixels[i + 1]);
  return true;
}

}  // namespace ygslam::png
