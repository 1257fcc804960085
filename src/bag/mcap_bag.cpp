#include "bag/mcap_bag.hpp"

#include <algorithm>

#include "bag/mcap_format.hpp"

namespace ygslam {
namespace {

bool is_magic(const Bytes& bytes) {
  return bytes.size() >= mcap::kMagic.size() &&
         std::equal(mcap::kMagic.begin(), mcap::kMagic.end(), bytes.begin());
}

/// The content of the record at `offset`; a chunk's is unpacked.
Result<Bytes> load_record(const InputFile& file, std::uint64_t offset) {
  const auto head = file.read(offset, mcap::kRecordHead);
  if (!head.ok()) return head.error();
  RecordReader reader(*head);
  const auto opcode = reader.number<std::uint8_t>();
  auto content = file.read(offset + mcap::kRecordHead, reader.number<std::uint64_t>());
  if (!content.ok() || opcode != mcap::kChunk) return content;
  return unpacked_chunk(*content);
}

}  // namespace

McapBag::McapBag(InputFile file)
    : file_(std::move(file)),
      records_([this](const auto& name, const auto& type,
                      Layout layout) { return add_topic(name, type, layout); },
               [this](const std::string& fault) { note(fault); }),
      blocks_([this](std::uint64_t offset) { return load_record(file_, offset); }) {}

Result<Bytes> McapBag::read(const MessagePlace& place) const {
  return blocks_.read(place.block, place.offset, place.bytes);
}

/// Behind the records of a recording another one may begin.
std::uint64_t McapBag::beginning_behind(std::uint64_t at) const {
  if (!file_.holds(at, 2 * mcap::kMagic.size())) return at;
  const auto magic = file_.read(at + mcap::kMagic.size(), mcap::kMagic.size());
  return magic.ok() && is_magic(*magic) ? at + mcap::kMagic.size() : at;
}

/// Of damage the next recording is all that can be understood. @return nothing: there is none.
std::optional<std::uint64_t> McapBag::beginning_after(std::uint64_t at) const {
  constexpr std::uint64_t kAtOnce = 1 << 20;
  constexpr std::uint64_t kOverlap = mcap::kMagic.size();
  const std::uint64_t end = std::min(file_.size(), at + kMostBlockBytes);
  for (; at < end; at += kAtOnce) {
    const auto bytes = file_.read(at, std::min(kAtOnce + kOverlap, file_.size() - at));
    if (!bytes.ok()) return std::nullopt;
    const std::size_t place = mcap::beginning_in(*bytes);
    if (place != std::string_view::npos) return at + place;
  }
  return std::nullopt;
}

/// @param at moves behind it. @return false: nothing that follows can be read.
bool McapBag::visit_record(const Bytes& head, std::uint64_t& at, const Visitor& visitor,
                           ExpansionLimit& expansion) {
  if (is_magic(head)) {
    at += mcap::kMagic.size();
    ++recordings_;
    records_.begin_anew();
    has_ended_ = false;
    return true;
  }
  RecordReader reader(head);
  const auto opcode = reader.number<std::uint8_t>();
  const auto length = reader.number<std::uint64_t>();
  // No record has the number 0: what was never written is zeros, perhaps without end.
  if (opcode == 0 || length > file_.size() - at - mcap::kRecordHead) {
    const auto next = beginning_after(at);
    at = next.value_or(at);
    return next.has_value();
  }
  const std::uint64_t content_at = at + mcap::kRecordHead;
  has_ended_ = records_.is_end(opcode, length) || has_ended_;
  at = content_at + length;
  if (opcode == mcap::kFooter && has_ended_) at = beginning_behind(at);
  if (!McapRecords::is_used(opcode) || has_ended_) return true;
  const auto content = file_.read(content_at, length);
  if (!content.ok()) {
    note(length > kMostBlockBytes ? "a record of " + std::to_string(length) + " bytes"
                                  : content.error().message);
    return true;
  }
  if (const std::size_t place = mcap::beginning_in(*content); place != std::string_view::npos) {
    at = content_at + place;
    return true;
  }
  if (opcode == mcap::kChunk && !expansion.take(expansion_of_chunk(*content))) return false;
  records_.take(opcode, *content, {0, content_at - mcap::kRecordHead, 0, length}, visitor);
  return true;
}

Status McapBag::visit(const Visitor& visitor, const Interrupted& interrupted) {
  std::uint64_t at = mcap::kMagic.size();
  ExpansionLimit expansion(file_.size());
  while (file_.holds(at, mcap::kRecordHead)) {
    if (interrupted && interrupted()) return interruption(file_.path());
    const auto head = file_.read(at, mcap::kRecordHead);
    if (!head.ok())
      return Error{ErrorKind::kInput, file_.path().string() + ": " + head.error().message};
    if (!visit_record(*head, at, visitor, expansion)) break;
  }
  if (expansion.is_reached() && topics_.empty()) return ExpansionLimit::error(file_.path());
  if (recordings_ > 1)
    warnings_.push_back(file_.path().string() + ": " + std::to_string(recordings_) +
                        " recordings follow each other, as if their writer was started again");
  if (expansion.is_reached()) {
    warnings_.push_back(ExpansionLimit::error(file_.path()).message);
  } else if (!has_ended_) {
    warnings_.push_back(file_.path().string() + ": ends early, read as far as it goes");
  }
  warn_of_faults(file_.path().string());
  return Ok{};
}

}  // namespace ygslam
