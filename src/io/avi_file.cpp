#include "io/avi_file.hpp"

#include <algorithm>

namespace ygslam {
namespace {

// Microsoft, "AVI RIFF File Reference".
constexpr std::uint32_t kHasIndex = 0x10, kKeyFrame = 0x10;

void put16(std::string& bytes, std::uint32_t value) {
  for (int shift = 0; shift < 16; shift += 8) bytes += static_cast<char>(value >> shift & 0xffU);
}
void put32(std::string& bytes, std::uint32_t value) {
  put16(bytes, value & 0xffffU);
  put16(bytes, value >> 16);
}

std::string chunk(const char* name, const std::string& content) {
  std::string bytes = name;
  put32(bytes, static_cast<std::uint32_t>(content.size()));
  bytes += content;
  if (content.size() % 2 != 0) bytes += '\0';
  return bytes;
}
std::string list(const char* name, const char* kind, const std::string& content) {
  return chunk(name, kind + content);
}

}  // namespace

Status AviFile::add(std::string_view jpeg) {
  if (images_.size() + jpeg.size() > kMostBytes)
    return Error{ErrorKind::kUsage, "the video would be larger than 1 GB: fewer or smaller images"};
  sizes_.push_back(static_cast<std::uint32_t>(jpeg.size()));
  images_ += chunk("00dc", std::string(jpeg));
  return Ok{};
}

std::string AviFile::bytes() const {
  const auto width = static_cast<std::uint32_t>(size_.width);
  const auto height = static_cast<std::uint32_t>(size_.height);
  const auto count = static_cast<std::uint32_t>(sizes_.size());
  const auto rate = static_cast<std::uint32_t>(frames_per_s_);
  const std::uint32_t largest =
      sizes_.empty() ? 0 : *std::max_element(sizes_.begin(), sizes_.end());
  std::string file_header, stream_header, format, index;
  for (const std::uint32_t value : {1000000 / rate, largest * rate, 0U, kHasIndex, count, 0U, 1U,
                                    largest, width, height, 0U, 0U, 0U, 0U})
    put32(file_header, value);
  stream_header = "vidsMJPG";
  for (const std::uint32_t value : {0U, 0U, 0U, 1U, rate, 0U, count, largest, 0xffffffffU, 0U})
    put32(stream_header, value);
  for (const std::uint32_t value : {0U, 0U, width, height}) put16(stream_header, value);
  for (const std::uint32_t value : {40U, width, height}) put32(format, value);
  put16(format, 1);   // planes
  put16(format, 24);  // bits
  format += "MJPG";
  for (const std::uint32_t value : {3 * width * height, 0U, 0U, 0U, 0U}) put32(format, value);
  std::uint32_t offset = 4;  // from "movi"
  for (const std::uint32_t size : sizes_) {
    index += "00dc";
    for (const std::uint32_t value : {kKeyFrame, offset, size}) put32(index, value);
    offset += 8 + size + size % 2;
  }
  const std::string stream =
      list("LIST", "strl", chunk("strh", stream_header) + chunk("strf", format));
  return list("RIFF", "AVI ",
              list("LIST", "hdrl", chunk("avih", file_header) + stream) +
                  list("LIST", "movi", images_) + chunk("idx1", index));
}

}  // namespace ygslam
