#include "io/pnm_codec.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "io/text.hpp"

namespace ygslam::pnm {
namespace {

static_assert(std::endian::native == std::endian::little);

Error pnm_fault(std::string reason) { return {ErrorKind::kInput, std::move(reason)}; }

struct Map {
  ImageHeader header;
  bool is_big_endian = true;
  std::string_view data;
};

/// The next word; comments (# to the end of the line) are passed over.
std::string_view take_word(std::string_view& rest) {
  constexpr std::string_view kBlanks = " \t\r\n";
  for (;;) {
    rest.remove_prefix(std::min(rest.find_first_not_of(kBlanks), rest.size()));
    if (!rest.starts_with('#')) break;
    rest.remove_prefix(std::min(rest.find('\n'), rest.size()));
  }
  const std::size_t length = std::min(rest.find_first_of(kBlanks), rest.size());
  const std::string_view word = rest.substr(0, length);
  rest.remove_prefix(length);
  return word;
}

Result<Map> map_of(std::string_view bytes) {
  Map map;
  const bool is_float = bytes.starts_with("Pf");
  map.header.channels = bytes.starts_with("P6") ? 3 : 1;
  map.header.format = is_float ? "PFM" : map.header.channels == 3 ? "PPM" : "PGM";
  std::string_view rest = bytes.substr(2);
  const auto width = parse_number(take_word(rest));
  const auto height = parse_number(take_word(rest));
  const auto most = parse_number(take_word(rest));  // of a PFM the scale
  if (!width || !height || !most || rest.empty())
    return pnm_fault("corrupt or truncated " + std::string(map.header.format));
  rest.remove_prefix(1);  // one blank ends the head
  const auto side = [](double px) {
    const bool is_whole = px >= 1 && px <= kMaxImageSide_px && px == std::floor(px);
    return is_whole ? static_cast<int>(px) : 0;  // which is refused as absurd
  };
  map.header.size = {side(*width), side(*height)};
  map.header.is_float = is_float;
  map.is_big_endian = !is_float || *most > 0;
  if (!is_float && !(*most >= 1 && *most <= 65535))
    return pnm_fault("corrupt " + std::string(map.header.format) + " (its largest value)");
  map.header.bits = is_float ? 32 : *most > 255 ? 16 : 8;
  map.data = rest;
  return map;
}

}  // namespace

bool has_signature(std::string_view bytes) {
  const bool is_named =
      bytes.starts_with("P5") || bytes.starts_with("P6") || bytes.starts_with("Pf");
  return is_named && bytes.size() > 2 &&
         std::string_view(" \t\r\n#").find(bytes[2]) != std::string_view::npos;
}

Result<ImageHeader> header(std::string_view bytes) {
  const auto map = map_of(bytes);
  if (!map.ok()) return map.error();
  return map->header;
}

Status decode(std::string_view bytes, std::uint8_t* pixels) {
  const auto map = map_of(bytes);
  if (!map.ok()) return map.error();
  const ImageHeader& header = map->header;
  const std::size_t sample_bytes = header.bits / 8;
  const std::size_t row_bytes = header.size.width * header.channels * sample_bytes;
  const auto height = static_cast<std::size_t>(header.size.height);
  if (map->data.size() < height * row_bytes)
    return pnm_fault("truncated " + std::string(header.format));
  for (std::size_t v = 0; v < height; ++v) {
    // PFM begins with the lowest row.
    const std::size_t from = header.is_float ? height - 1 - v : v;
    std::uint8_t* const row = pixels + v * row_bytes;
    std::memcpy(row, map->data.data() + from * row_bytes, row_bytes);
    if (!map->is_big_endian || sample_bytes == 1) continue;
    for (std::size_t i = 0; i < row_bytes; i += sample_bytes)
      std::reverse(row + i, row + i + sample_bytes);
  }
  return Ok{};
}

}  // namespace ygslam::pnm
