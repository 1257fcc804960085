#include "bag/mcap_stream.hpp"

#include <algorithm>

#include "bag/mcap_format.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

/// What the first bytes of a stream may be of instead, for the message.
std::string said_of(const std::string& start) {
  if (start.empty()) return ": ended before the first byte";
  if (start.starts_with("#ROSBAG") || start.starts_with("SQLite f"))
    return ": is another kind of bag, which cannot be read as a stream; give it as a file";
  return ": begins with '" + printable(start) + "', is no MCAP stream";
}

}  // namespace

McapStream::McapStream(ByteStream bytes)
    : bytes_(std::move(bytes)),
      records_([this](const auto& name, const auto& type,
                      Layout layout) { return add_topic(name, type, layout); },
               [this](const std::string& fault) { note(fault); }) {}

Result<std::unique_ptr<McapStream>> McapStream::open(ByteStream bytes,
                                                     const std::stop_token& stop) {
  std::unique_ptr<McapStream> stream(new McapStream(std::move(bytes)));
  std::array<std::uint8_t, mcap::kMagic.size()> start{};
  const std::size_t got = stream->bytes_.read(start, stop);
  if (start == mcap::kMagic) return stream;
  const auto& fault = stream->bytes_.fault();
  return Error{ErrorKind::kInput,
               stream->bytes_.name() + (fault ? ": " + *fault
                                        : stream->bytes_.was_stopped()
                                            ? ": interrupted before the first frame"
                                            : said_of({start.begin(), start.begin() + got}))};
}

bool McapStream::end(const std::string& fault) {
  has_ended_ = true;
  if (!fault.empty() && !bytes_.was_stopped())
    warnings_.push_back(bytes_.name() + ": " + bytes_.fault().value_or(fault) + " after " +
                        std::to_string(bytes_.at()) + " bytes, read as far as it goes");
  warn_of_faults(bytes_.name());
  return false;
}

bool McapStream::read_content(std::uint64_t length, bool is_kept, const std::stop_token& stop) {
  constexpr std::uint64_t kAtOnce = 1 << 20;  // memory for what came, not for what is promised
  content_.clear();
  while (length > 0) {
    const auto part = static_cast<std::size_t>(std::min(length, kAtOnce));
    const std::size_t before = is_kept ? content_.size() : 0;
    content_.resize(before + part);
    if (bytes_.read({content_.data() + before, part}, stop) < part) return false;
    length -= part;
  }
  return true;
}

bool McapStream::next(const MessageVisitor& visitor, const std::stop_token& stop) {
  if (has_ended_) return false;
  std::array<std::uint8_t, mcap::kRecordHead> head;
  const std::size_t got = bytes_.read(head, stop);
  if (got < head.size()) return end(data_has_ended_ ? "" : "ends early");
  RecordReader reader(head);
  const auto opcode = reader.number<std::uint8_t>();
  const auto length = reader.number<std::uint64_t>();
  if (opcode == 0 || length > kMostBlockBytes) return end("is damaged");
  const bool is_end = records_.is_end(opcode, length);
  data_has_ended_ = data_has_ended_ || is_end;
  const bool is_used = McapRecords::is_used(opcode) && !data_has_ended_;
  if (!read_content(length, is_used, stop)) return end(data_has_ended_ ? "" : "ends early");
  if (is_used) records_.take(opcode, content_, {}, visitor);
  if (!is_end || opcode != mcap::kFooter) return true;
  std::array<std::uint8_t, mcap::kMagic.size()> magic;  // so that who writes it is not left alone
  bytes_.read(magic, stop);
  return end("");
}

}  // namespace ygslam
