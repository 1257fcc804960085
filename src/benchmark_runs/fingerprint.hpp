// A short name for content: equal content, equal name.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace ygslam {

/// FNV-1a, 64 bit (Fowler, Noll, Vo). Tells changes, not forgeries.
class Fingerprint {
 public:
  void add(std::string_view bytes) {
    for (const char c : bytes) {
      hash_ = (hash_ ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
    }
    hash_ = (hash_ ^ 0xFFU) * 0x100000001b3ULL;  // so that "a", "b" is not "ab"
  }
  [[nodiscard]] std::string text() const {
    std::string digits(16, '0');
    std::uint64_t rest = hash_;
    for (auto digit = digits.rbegin(); digit != digits.rend(); ++digit, rest >>= 4) {
      *digit = "0123456789abcdef"[rest & 15U];
    }
    return digits;
  }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

}  // namespace ygslam
