#include "bag/mcap_stream.hpp"

#include <algorithm>

#include "bag/mcap_format.hpp"
#include "core/counted.hpp"
#include "core/log.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace {

/// A stream that has ended but is not closed may go on: a camera takes a while to start again.
constexpr auto kRestartPatience = std::chrono::seconds(10);

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

bool McapStream::end(const std::string& fault, std::optional<std::uint64_t> at) {
  has_ended_ = true;
  if (!fault.empty() && !bytes_.was_stopped())
    warnings_.push_back(bytes_.name() + ": " + bytes_.fault().value_or(fault) + " after " +
                        std::to_string(at.value_or(bytes_.at())) +
                        " bytes, read as far as it goes");
  warn_of_faults(bytes_.name());
  return false;
}

/// First what was read too early.
std::size_t McapStream::read(std::span<std::uint8_t> to, const std::stop_token& stop) {
  const std::size_t early = std::min(to.size(), ahead_.size() - ahead_at_);
  std::copy_n(ahead_.begin() + static_cast<std::ptrdiff_t>(ahead_at_), early, to.begin());
  ahead_at_ += early;
  return early + bytes_.read(to.subspan(early), stop);
}

bool McapStream::read_content(std::uint64_t length, bool is_kept, const std::stop_token& stop) {
  constexpr std::uint64_t kAtOnce = 1 << 20;  // memory for what came, not for what is promised
  content_.clear();
  while (length > 0) {
    const auto part = static_cast<std::size_t>(std::min(length, kAtOnce));
    const std::size_t before = is_kept ? content_.size() : 0;
    content_.resize(before + part);
    if (read({content_.data() + before, part}, stop) < part) return false;
    length -= part;
  }
  return true;
}

/// Another recording begins. @param ahead what was read of it.
void McapStream::begin_anew(std::span<const std::uint8_t> ahead) {
  Bytes rest(ahead.begin(), ahead.end());
  rest.insert(rest.end(), ahead_.begin() + static_cast<std::ptrdiff_t>(ahead_at_), ahead_.end());
  ahead_ = std::move(rest);
  ahead_at_ = 0;
  records_.begin_anew();
  data_has_ended_ = is_behind_end_ = false;
  if (is_worth_a_line(++beginnings_))
    log::warn("{}: begins anew after {} bytes, as if its writer was started again; the run goes on",
              bytes_.name(), bytes_.at() - ahead_.size());
}

/// After a recording's last record: its magic once more, then nothing or another one.
bool McapStream::look_behind_end(const std::stop_token& stop) {
  std::array<std::uint8_t, 2 * mcap::kMagic.size()> behind{};
  std::size_t got = read({behind.data(), mcap::kMagic.size()}, stop);
  if (got == mcap::kMagic.size())
    got += bytes_.read({behind.data() + got, mcap::kMagic.size()}, stop, kRestartPatience);
  if (got <= mcap::kMagic.size()) return end("");
  if (!std::equal(mcap::kMagic.begin(), mcap::kMagic.end(), behind.begin() + mcap::kMagic.size()))
    return end("goes on after its end with what is no MCAP");
  begin_anew({});
  return true;
}

/// Of damage, and what comes behind it, the next recording is all that can be understood.
bool McapStream::look_for_beginning(std::span<const std::uint8_t> head,
                                    const std::stop_token& stop) {
  constexpr std::size_t kAtOnce = 1 << 12;
  const std::uint64_t damaged_at = bytes_.at() - (ahead_.size() - ahead_at_);
  Bytes window(head.begin(), head.end());
  for (;;) {
    if (const std::size_t at = mcap::beginning_in(window); at != std::string_view::npos) {
      begin_anew(std::span(window).subspan(at + mcap::kMagic.size()));
      return true;
    }
    if (window.size() > mcap::kMagic.size())
      window.erase(window.begin(), window.end() - mcap::kMagic.size());
    const std::size_t before = window.size();
    window.resize(before + kAtOnce);
    const std::size_t got = read({window.data() + before, kAtOnce}, stop);
    window.resize(before + got);
    if (got == 0) return end("is damaged", damaged_at);
  }
}

bool McapStream::next(const MessageVisitor& visitor, const std::stop_token& stop) {
  if (has_ended_) return false;
  if (is_behind_end_) return look_behind_end(stop);
  std::array<std::uint8_t, mcap::kRecordHead> head;
  if (read(head, stop) < head.size()) return end(data_has_ended_ ? "" : "ends early");
  if (std::equal(mcap::kMagic.begin(), mcap::kMagic.end(), head.begin())) {
    begin_anew(std::span(head).subspan(mcap::kMagic.size()));
    return true;
  }
  RecordReader reader(head);
  const auto opcode = reader.number<std::uint8_t>();
  const auto length = reader.number<std::uint64_t>();
  if (opcode == 0 || length > kMostBlockBytes) return look_for_beginning(head, stop);
  const bool is_end = records_.is_end(opcode, length);
  data_has_ended_ = data_has_ended_ || is_end;
  const bool is_used = McapRecords::is_used(opcode) && !data_has_ended_;
  if (!read_content(length, is_used, stop)) return end(data_has_ended_ ? "" : "ends early");
  is_behind_end_ = is_end && opcode == mcap::kFooter;
  if (!is_used) return true;
  if (const std::size_t at = mcap::beginning_in(content_); at != std::string_view::npos) {
    begin_anew(std::span(content_).subspan(at + mcap::kMagic.size()));
  } else {
    records_.take(opcode, content_, {}, visitor);
  }
  return true;
}

}  // namespace ygslam
