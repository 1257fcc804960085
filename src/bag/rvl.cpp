#include "bag/rvl.hpp"

#include <algorithm>
#include <optional>

namespace ygslam {
namespace {

/// Numbers of variable length: three bits in a nibble, the lowest first, the fourth says that more
/// follow. Nibbles come from the upper end of little-endian words of 32 bits.
class RvlNumbers {
 public:
  explicit RvlNumbers(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  std::optional<std::uint32_t> next() {
    constexpr int kMostNibbles = 11;  // of 32 bits
    std::uint32_t value = 0;
    for (int i = 0; i < kMostNibbles; ++i) {
      const std::size_t word = at_ / 8 * 4;
      if (word + 4 > bytes_.size()) return std::nullopt;
      const std::size_t in_word = at_ % 8;
      const std::uint8_t byte = bytes_[word + 3 - in_word / 2];
      const std::uint32_t nibble = in_word % 2 == 0 ? byte >> 4U : byte & 15U;
      ++at_;
      value |= (nibble & 7U) << (3 * i);
      if ((nibble & 8U) == 0) return value;
    }
    return std::nullopt;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;  // in nibbles
};

}  // namespace

Result<Image<std::uint16_t>> decode_rvl(std::span<const std::uint8_t> bytes,
                                        const ImageSize& size) {
  const Error ends_early{ErrorKind::kInput, "truncated RVL"};
  const Error too_long{ErrorKind::kInput, "corrupt RVL (more pixels than the image has)"};
  Image<std::uint16_t> image(size.width, size.height);
  RvlNumbers numbers(bytes);
  std::uint16_t before = 0;
  for (std::size_t at = 0; at < image.size();) {
    const auto zeros = numbers.next();
    if (!zeros) return ends_early;
    if (*zeros > image.size() - at) return too_long;
    at += *zeros;
    const auto others = at < image.size() ? numbers.next() : 0;
    if (!others) return ends_early;
    if (*others > image.size() - at) return too_long;
    if (*zeros == 0 && *others == 0) return Error{ErrorKind::kInput, "corrupt RVL (empty runs)"};
    for (const std::size_t end = at + *others; at < end; ++at) {
      const auto change = numbers.next();  // its sign in the lowest bit
      if (!change) return ends_early;
      const std::uint32_t delta = (*change >> 1U) ^ (0U - (*change & 1U));
      image.data()[at] = before = static_cast<std::uint16_t>(before + delta);
    }
  }
  return image;
}

}  // namespace ygslam
