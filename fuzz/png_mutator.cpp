// Mutated PNGs get the check sums of their chunks put right: otherwise hardly one passes libpng's
// first test.
#include <zlib.h>

#include <cstddef>
#include <cstdint>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

std::uint32_t read_u32(const std::uint8_t* from) {
  return std::uint32_t{from[0]} << 24U | std::uint32_t{from[1]} << 16U |
         std::uint32_t{from[2]} << 8U | from[3];
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned /*seed*/) {
  size = LLVMFuzzerMutate(data, size, max_size);
  constexpr std::size_t kSignature = 8, kAround = 12;  // length and type before, check sum after
  for (std::size_t at = kSignature; at + kAround <= size;) {
    const std::size_t length = read_u32(data + at);
    if (length > size - at - kAround) break;
    const auto sum =
        static_cast<std::uint32_t>(crc32(0, data + at + 4, static_cast<uInt>(length + 4)));
    for (unsigned i = 0; i < 4; ++i)
      data[at + 8 + length + i] = static_cast<std::uint8_t>(sum >> (24 - 8 * i));
    at += kAround + length;
  }
  return size;
}
