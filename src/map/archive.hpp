// Numbers to bytes and back, little endian. One function template serves both ways: with a writer
// it appends what it is given, with a reader it sets it.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace ygslam {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie");

class ArchiveWriter {
 public:
  static constexpr bool kReads = false;

  template <typename T>
  void number(const T& value) {
    const auto* bytes = reinterpret_cast<const char*>(&value);
    bytes_.append(bytes, sizeof(T));
  }
  template <typename T>
  void count(const T& container, std::size_t /*least_bytes_each*/ = 1,
             std::size_t /*most*/ = std::numeric_limits<std::size_t>::max()) {
    number(static_cast<std::uint32_t>(container.size()));
  }
  /// value(i) for all i < n: first the lowest byte of each, then the next of each and so on. Bytes
  /// that resemble each other stand together, which a compressor likes.
  template <typename T, typename Value>
  void column(std::size_t n, Value&& value) {
    const std::size_t start = bytes_.size();
    bytes_.resize(start + n * sizeof(T));
    for (std::size_t b = 0; b <= sizeof(T); ++b) parts_.push_back(start + b * n);
    char* const planes = bytes_.data() + start;
    for (std::size_t i = 0; i < n; ++i) {
      const T v = value(i);
      const auto* bytes = reinterpret_cast<const char*>(&v);
      for (std::size_t b = 0; b < sizeof(T); ++b) planes[b * n + i] = bytes[b];
    }
  }
  void check(bool, const char*) {}
  [[nodiscard]] static constexpr bool ok() { return true; }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  /// Places at which bytes of another kind begin, ascending: there a compressor starts afresh.
  [[nodiscard]] const std::vector<std::size_t>& parts() const { return parts_; }
  /// Keeps its memory.
  void clear() {
    bytes_.clear();
    parts_.clear();
  }

 private:
  std::string bytes_;
  std::vector<std::size_t> parts_;
};

/// After a fault everything reads as zero, ok() is false and fault() says what it was.
class ArchiveReader {
 public:
  static constexpr bool kReads = true;
  static constexpr const char* kNotFinite = "a number is not finite";

  explicit ArchiveReader(std::span<const char> bytes) : bytes_(bytes) {}

  template <typename T>
  void number(T& value) {
    check(sizeof(T) <= bytes_.size(), "cut short");
    if (!ok()) return;
    std::memcpy(&value, bytes_.data(), sizeof(T));
    bytes_ = bytes_.subspan(sizeof(T));
    if constexpr (std::is_floating_point_v<T>) check(std::isfinite(value), kNotFinite);
  }
  /// No count asks for more memory than the input can fill.
  template <typename T>
  void count(T& container, std::size_t least_bytes_each = 1,
             std::size_t most = std::numeric_limits<std::size_t>::max()) {
    std::uint32_t n = 0;
    number(n);
    check(n <= most && n <= bytes_.size() / least_bytes_each, "cut short, or a count too large");
    if (ok()) container.resize(n);
  }
  template <typename T, typename Value>
  void column(std::size_t n, Value&& value) {
    check(n <= bytes_.size() / sizeof(T), "cut short");
    if (!ok()) return;
    const char* const planes = bytes_.data();
    bool finite = true;
    for (std::size_t i = 0; i < n; ++i) {
      std::array<char, sizeof(T)> bytes;
      for (std::size_t b = 0; b < sizeof(T); ++b) bytes[b] = planes[b * n + i];
      const T v = std::bit_cast<T>(bytes);
      if constexpr (std::is_floating_point_v<T>) finite = finite && std::isfinite(v);
      value(i) = v;
    }
    bytes_ = bytes_.subspan(n * sizeof(T));
    check(finite, kNotFinite);
  }
  void check(bool holds, const char* otherwise) {
    if (!holds && fault_ == nullptr) fault_ = otherwise;
  }
  [[nodiscard]] bool ok() const { return fault_ == nullptr; }
  /// Null while all is well.
  [[nodiscard]] const char* fault() const { return fault_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size(); }
  void check_end() { check(bytes_.empty(), "bytes left over"); }

 private:
  std::span<const char> bytes_;
  const char* fault_ = nullptr;
};

}  // namespace ygslam
