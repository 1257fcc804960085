// Reads MCAP (mcap.dev/spec) while it is written: nothing is sought, no index is needed.
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
  bool end(const std::string& fault);
  bool read_content(std::uint64_t length, bool is_kept, const std::stop_token& stop);

  ByteStream bytes_;
  McapRecords records_;
  Bytes content_;
  bool data_has_ended_ = false;  // what follows says it once more
  bool has_ended_ = false;
};

}  // namespace ygslam
