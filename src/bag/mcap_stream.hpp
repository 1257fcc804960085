// Reads MCAP (mcap.dev/spec) while it is written: nothing is sought, no index is needed. Recordings
// may follow each other, as those of a camera that is started again do.
#pragma once

#include "bag/byte_stream.hpp"
#include "bag/mcap_records.hpp"

namespace ygslam {

class McapStream final : public MessageReader {
 public:
  /// Waits for the first bytes. @return kInput, in one line, where they are none of MCAP.
  static Result<std::unique_ptr<McapStream>> open(ByteStream bytes, const std::stop_token& stop);

  /// Waits for the next record and hands its messages over. What ends it early is then told in
  /// warnings(), as are records that had to be left out.
  /// @return false at the end, or once stopped.
  bool next(const MessageVisitor& visitor, const std::stop_token& stop);

  [[nodiscard]] const ByteStream& bytes() const { return bytes_; }

 private:
  explicit McapStream(ByteStream bytes);
  bool end(const std::string& fault, std::optional<std::uint64_t> at = {});
  std::size_t read(std::span<std::uint8_t> to, const std::stop_token& stop);
  bool read_content(std::uint64_t length, bool is_kept, const std::stop_token& stop);
  bool look_behind_end(const std::stop_token& stop);
  bool look_for_beginning(std::span<const std::uint8_t> head, const std::stop_token& stop);
  void begin_anew(std::span<const std::uint8_t> ahead);

  ByteStream bytes_;
  McapRecords records_;
  Bytes content_;
  Bytes ahead_;  // read too early
  std::size_t ahead_at_ = 0;
  std::uint64_t beginnings_ = 0;  // after the first
  bool data_has_ended_ = false;   // what follows says it once more
  bool is_behind_end_ = false;    // of a recording
  bool has_ended_ = false;
};

}  // namespace ygslam
