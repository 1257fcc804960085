// What MCAP's records say, whether they come from a file or a stream.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "bag/bag.hpp"
#include "bag/input_file.hpp"

namespace ygslam {

/// Remembers schemas and channels, hands over messages.
class McapRecords {
 public:
  using AddTopic =
      std::function<std::size_t(const std::string& name, const std::string& type, Layout layout)>;
  using Note = std::function<void(const std::string& fault)>;
  /// @param note is told what is left out.
  McapRecords(AddTopic add_topic, Note note)
      : add_topic_(std::move(add_topic)), note_(std::move(note)) {}

  /// Another recording begins: its numbers are its own.
  void begin_anew() {
    type_of_.clear();
    topic_of_.clear();
  }
  /// Whether a record of this kind may hold anything of interest.
  [[nodiscard]] static bool is_used(std::uint8_t opcode);
  /// Whether a record ends the messages. One of another length than those that do was hit: noted.
  [[nodiscard]] bool is_end(std::uint8_t opcode, std::uint64_t length) const;
  /// A record's content; of a chunk all its records.
  /// @param place where the content lies.
  void take(std::uint8_t opcode, std::span<const std::uint8_t> content, MessagePlace place,
            const MessageVisitor& visitor);

 private:
  void take_chunk(std::span<const std::uint8_t> records, std::uint64_t chunk,
                  const MessageVisitor& visitor);
  void take_one(std::uint8_t opcode, std::span<const std::uint8_t> content, MessagePlace place,
                const MessageVisitor& visitor);
  void add_channel(std::span<const std::uint8_t> content);

  AddTopic add_topic_;
  Note note_;
  std::map<std::uint16_t, std::string> type_of_;                  // of a schema
  std::map<std::uint16_t, std::optional<std::size_t>> topic_of_;  // none: of another encoding
};

/// What a chunk says that its records come to; 0 if they are not compressed or it cannot be read.
[[nodiscard]] std::uint64_t expansion_of_chunk(std::span<const std::uint8_t> content);
/// A chunk's records. @return kInput with a reason alone.
[[nodiscard]] Result<Bytes> unpacked_chunk(std::span<const std::uint8_t> content);

}  // namespace ygslam
