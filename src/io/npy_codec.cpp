#include "io/npy_codec.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

#include "io/text.hpp"

namespace ygslam::npy {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
static_assert(std::endian::native == std::endian::little);

Error npy_fault(std::string reason) { return {ErrorKind::kInput, std::move(reason)}; }

/// An array as its head tells it.
struct Array {
  ImageHeader header;
  bool is_big_endian = false;
  std::size_t bytes = 0;  ///< of one number
  std::string_view data;
};

/// What stands behind a key of the head, which is a dict of Python.
std::string_view value_of(std::string_view dict, std::string_view key) {
  const std::size_t at = dict.find(key);
  if (at == std::string_view::npos) return {};
  const std::size_t colon = dict.find(':', at + key.size());
  return colon == std::string_view::npos ? std::string_view() : trimmed(dict.substr(colon + 1));
}

/// Without the sides of length 1 around height and width.
std::vector<double> sides_of(std::string_view shape) {
  std::vector<double> sides;
  const std::size_t end = shape.find(')');
  if (!shape.starts_with('(') || end == std::string_view::npos) return {};
  for (const std::string_view word : words_of(shape.substr(1, end - 1), ",")) {
    const auto side = parse_number(word);
    if (!side || *side < 0 || sides.size() == 3) return {};
    sides.push_back(*side);
  }
  if (sides.size() == 3 && sides.back() == 1) sides.pop_back();
  if (sides.size() == 3 && sides.front() == 1) sides.erase(sides.begin());
  return sides;
}

Status set_type(std::string_view descr, Array& array) {
  const std::string_view type =
      descr.size() > 4 ? descr.substr(1, descr.find_first_of("'\"", 1) - 1) : std::string_view();
  const bool is_known = type == "|u1" || type.ends_with("u2") || type.ends_with("f2") ||
                        type.ends_with("f4") || type.ends_with("f8");
  if (type.size() != 3 || !is_known || std::string_view("<>|=").find(type[0]) == std::string::npos)
    return npy_fault("a NumPy array of type " +
                     printable(descr.substr(0, std::min<std::size_t>(descr.find(", '"), 24))) +
                     " is not read: uint16 and floats are");
  array.is_big_endian = type[0] == '>';
  array.bytes = static_cast<std::size_t>(type[2] - '0');
  array.header.is_float = type[1] == 'f';
  array.header.bits = array.header.is_float ? 32 : static_cast<int>(8 * array.bytes);
  return Ok{};
}

Result<Array> array_of(std::string_view bytes) {
  constexpr std::size_t kVersionAt = 6;
  if (bytes.size() < kVersionAt + 6) return npy_fault("truncated NumPy file");
  const bool is_first = bytes[kVersionAt] == 1;
  const std::size_t head_at = kVersionAt + (is_first ? 4 : 6);
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + kVersionAt + 2, is_first ? 2 : 4);
  if (length > bytes.size() - head_at) return npy_fault("truncated NumPy file");
  const std::string_view dict = bytes.substr(head_at, length);
  Array array;
  if (Status typed = set_type(value_of(dict, "descr"), array); !typed.ok()) return typed.error();
  if (!value_of(dict, "fortran_order").starts_with("False"))
    return npy_fault("a NumPy array with columns first is not read: save np.ascontiguousarray()");
  const auto sides = sides_of(value_of(dict, "shape"));
  if (sides.size() != 2)
    return npy_fault(
        "a NumPy array of shape " +
        printable(value_of(dict, "shape").substr(0, value_of(dict, "shape").find(')') + 1), 24) +
        " is no image of H x W");
  constexpr double kTooMuch = kMaxImageSide_px + 1;
  array.header.size = {static_cast<int>(std::min(sides[1], kTooMuch)),
                       static_cast<int>(std::min(sides[0], kTooMuch))};
  array.header.channels = 1;
  array.header.format = "NumPy";
  array.data = bytes.substr(head_at + length);
  return array;
}

template <typename T>
T number_at(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

float float_at(const char* at, std::size_t bytes) {
  if (bytes == 2)
    return static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(number_at<std::uint16_t>(at)));
  return bytes == 4 ? number_at<float>(at) : static_cast<float>(number_at<double>(at));
}

}  // namespace

bool has_signature(std::string_view bytes) { return bytes.starts_with(kMagic); }

Result<ImageHeader> header(std::string_view bytes) {
  const auto array = array_of(bytes);
  if (!array.ok()) return array.error();
  return array->header;
}

Status decode(std::string_view bytes, std::uint8_t* pixels) {
  const auto array = array_of(bytes);
  if (!array.ok()) return array.error();
  const auto count = static_cast<std::size_t>(array->header.size.width) * array->header.size.height;
  if (array->data.size() < count * array->bytes) return npy_fault("truncated NumPy file");
  if (array->data.size() > count * array->bytes)
    return npy_fault("a NumPy file with more bytes than its head says");
  std::array<char, sizeof(double)> number{};
  const std::size_t to_bytes = array->header.bits / 8;
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(number.data(), array->data.data() + i * array->bytes, array->bytes);
    if (array->is_big_endian)
      std::reverse(number.begin(), number.begin() + static_cast<std::ptrdiff_t>(array->bytes));
    if (array->header.is_float) {
      const float value = float_at(number.data(), array->bytes);
      std::memcpy(pixels + i * to_bytes, &value, sizeof value);
    } else {
      std::memcpy(pixels + i * to_bytes, number.data(), to_bytes);
    }
  }
  return Ok{};
}

}  // namespace ygslam::npy
