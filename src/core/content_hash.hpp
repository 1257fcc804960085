// A number that tells contents apart: equal contents give equal numbers on every machine of one
// byte order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ygslam {

class ContentHash {
 public:
  void add(std::uint64_t word) {
    hash_ = (hash_ ^ word) * 0x9e3779b97f4a7c15ULL;
    hash_ ^= hash_ >> 32;
  }
  /// @tparam Array of whole numbers, its size a multiple of eight bytes.
  template <typename Array>
  void add_all(const Array& array) {
    static_assert(sizeof(Array) % sizeof(std::uint64_t) == 0);
    const auto* bytes = reinterpret_cast<const std::byte*>(array.data());
    for (std::size_t i = 0; i < sizeof(Array); i += sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes + i, sizeof(word));
      add(word);
    }
  }
  [[nodiscard]] std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

}  // namespace ygslam
