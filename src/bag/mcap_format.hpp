// What MCAP's reader and writer share: the records of mcap.dev/spec.
#pragma once

#include <array>
#include <cstring>
#include <span>
#include <string>
#include <string_view>

#include "bag/cdr.hpp"

namespace ygslam::mcap {

inline constexpr std::array<std::uint8_t, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};

/// Where in a record's content another recording begins: whoever wrote it ended in the middle of it
/// and was started again. @return npos: nowhere.
[[nodiscard]] inline std::size_t beginning_in(std::span<const std::uint8_t> content) {
  constexpr std::string_view kBeginning("\x89MCAP0\r\n\x01", kMagic.size() + 1);  // and a header
  return std::string_view(reinterpret_cast<const char*>(content.data()), content.size())
      .find(kBeginning);
}

/// In front of every record: opcode and length.
inline constexpr std::uint64_t kRecordHead = 9;

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kDataEnd = 0x0F,
};

inline void append(Bytes& to, const Bytes& from) { to.insert(to.end(), from.begin(), from.end()); }

/// Opcode, length and content of a record, little-endian and unaligned.
class Record {
 public:
  explicit Record(Opcode opcode) : bytes_(kRecordHead) { bytes_[0] = opcode; }

  template <typename T>
  Record& number(T value) {
    return raw({reinterpret_cast<const std::uint8_t*>(&value), sizeof value});
  }
  Record& text(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size()));
    return raw({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }
  Record& raw(std::span<const std::uint8_t> bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  [[nodiscard]] Bytes bytes() const {
    Bytes all = bytes_;
    const std::uint64_t length = all.size() - kRecordHead;
    std::memcpy(all.data() + 1, &length, sizeof length);
    return all;
  }

 private:
  Bytes bytes_;
};

}  // namespace ygslam::mcap
