// CDR, the byte layout of ROS 2's messages (OMG DDS-XTypes 1.3, 7.4.1, PLAIN_CDR): little-endian,
// numbers aligned to their size after a head of four bytes. A message lists its fields once, in
// `fields`, for reading and for writing. What ROS 1 wrote is read, too.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace ygslam {

static_assert(std::endian::native == std::endian::little,
              "bytes are written as they lie in memory");

using Bytes = std::vector<std::uint8_t>;

class CdrWriter {
 public:
  template <typename... Fields>
  void operator()(const Fields&... fields) {
    (write(fields), ...);
  }
  [[nodiscard]] Bytes take() { return std::move(bytes_); }

 private:
  static constexpr std::size_t kHead = 4;

  template <typename T>
  void write(const T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      write_numbers(&value, 1);
    } else {
      T::fields(value, *this);
    }
  }
  void write(const std::string& text) {
    write(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.insert(bytes_.end(), text.c_str(), text.c_str() + text.size() + 1);
  }
  template <typename T, std::size_t n>
  void write(const std::array<T, n>& values) {
    write_numbers(values.data(), n);
  }
  template <typename T>
  void write(const std::vector<T>& values) {
    write(static_cast<std::uint32_t>(values.size()));
    if constexpr (std::is_arithmetic_v<T>) {
      write_numbers(values.data(), values.size());
    } else {
      for (const T& value : values) write(value);
    }
  }
  template <typename T>
  void write_numbers(const T* values, std::size_t n) {
    if (n == 0) return;
    while ((bytes_.size() - kHead) % sizeof(T) != 0) bytes_.push_back(0);
    const std::size_t at = bytes_.size();
    bytes_.resize(at + n * sizeof(T));
    std::memcpy(bytes_.data() + at, values, n * sizeof(T));
  }

  Bytes bytes_{0, 1, 0, 0};  // plain, little-endian, no options
};

/// How the fields of a message lie in its bytes.
enum class Layout {
  kCdr,
  kRos1,   ///< little-endian, no head, no padding, no zero after text; headers are counted
  kOther,  ///< not read: protobuf, JSON, ...
};

/// After the end of the bytes, or after a length that they do not hold, everything read is zero or
/// empty and ok() is false.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::uint8_t> bytes, Layout layout = Layout::kCdr)
      : bytes_(bytes), is_ros1_(layout == Layout::kRos1) {
    if (layout == Layout::kOther) ok_ = false;
    if (layout != Layout::kCdr) return;
    at_ = kHead;
    ok_ = bytes.size() >= kHead && bytes[0] == 0 && bytes[1] <= 1;
    swaps_ = ok_ && bytes[1] == 0;
  }

  template <typename... Fields>
  void operator()(Fields&... fields) {
    (read(fields), ...);
  }
  [[nodiscard]] bool ok() const { return ok_; }

 private:
  static constexpr std::size_t kHead = 4;

  template <typename T>
  void read(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      value = T{};
      read_numbers(&value, 1);
    } else {
      if constexpr (requires { T::kCountedInRos1; }) {
        std::uint32_t count = 0;
        if (is_ros1_) read(count);
      }
      T::fields(value, *this);
    }
  }
  void read(std::string& text) {
    const std::uint32_t length = read_count(1);
    const std::uint32_t shown = is_ros1_ || length == 0 ? length : length - 1;  // without the zero
    text.clear();
    if (shown > 0) text.assign(reinterpret_cast<const char*>(bytes_.data() + at_), shown);
    at_ += length;
  }
  template <typename T, std::size_t n>
  void read(std::array<T, n>& values) {
    values = {};
    read_numbers(values.data(), n);
  }
  template <typename T>
  void read(std::vector<T>& values) {
    if constexpr (std::is_arithmetic_v<T>) {
      values.assign(read_count(sizeof(T)), T{});
      read_numbers(values.data(), values.size());
    } else {
      values.clear();
      for (std::uint32_t left = read_count(1); left > 0 && ok_; --left) read(values.emplace_back());
    }
  }
  /// A count of things of at least so many bytes each, as many as can be there.
  std::uint32_t read_count(std::size_t least_bytes) {
    std::uint32_t count = 0;
    read(count);
    if (ok_ && count > (bytes_.size() - at_) / least_bytes) ok_ = false;
    return ok_ ? count : 0;
  }
  template <typename T>
  void read_numbers(T* values, std::size_t n) {
    if (n == 0) return;
    const std::size_t from =
        is_ros1_ ? at_ : kHead + (at_ - kHead + sizeof(T) - 1) / sizeof(T) * sizeof(T);
    if (!ok_ || from > bytes_.size() || n > (bytes_.size() - from) / sizeof(T)) {
      ok_ = false;
      return;
    }
    std::memcpy(values, bytes_.data() + from, n * sizeof(T));
    at_ = from + n * sizeof(T);
    if (swaps_ && sizeof(T) > 1) {
      for (std::size_t i = 0; i < n; ++i) {
        auto* bytes = reinterpret_cast<std::uint8_t*>(values + i);
        std::reverse(bytes, bytes + sizeof(T));
      }
    }
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool is_ros1_;
  bool ok_ = true;
  bool swaps_ = false;
};

template <typename Message>
[[nodiscard]] Bytes to_cdr(const Message& message) {
  CdrWriter writer;
  writer(message);
  return writer.take();
}

/// @return false if the bytes end early or are no plain CDR; `message` is then undefined.
template <typename Message>
[[nodiscard]] bool from_cdr(std::span<const std::uint8_t> bytes, Message& message,
                            Layout layout = Layout::kCdr) {
  CdrReader reader(bytes, layout);
  reader(message);
  return reader.ok();
}

}  // namespace ygslam
