#include "bag/mcap_bag.hpp"

#include "bag/mcap_format.hpp"

namespace ygslam {
namespace {

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

Status McapBag::visit(const Visitor& visitor, const Interrupted& interrupted) {
  std::uint64_t at = mcap::kMagic.size();
  bool ended = false;
  ExpansionLimit expansion(file_.size());
  while (!ended && file_.holds(at, mcap::kRecordHead)) {
    if (interrupted && interrupted()) return interruption(file_.path());
    const auto head = file_.read(at, mcap::kRecordHead);
    if (!head.ok())
      return Error{ErrorKind::kInput, file_.path().string() + ": " + head.error().message};
    RecordReader reader(*head);
    const auto opcode = reader.number<std::uint8_t>();
    const auto length = reader.number<std::uint64_t>();
    // No record has the number 0: what was never written is zeros, perhaps without end.
    if (opcode == 0 || length > file_.size() - at - mcap::kRecordHead) break;
    ended = records_.is_end(opcode, length);
    if (McapRecords::is_used(opcode)) {
      const auto content = file_.read(at + mcap::kRecordHead, length);
      if (content.ok() && opcode == mcap::kChunk && !expansion.take(expansion_of_chunk(*content))) {
        break;
      } else if (content.ok()) {
        records_.take(opcode, *content, {0, at, 0, length}, visitor);
      } else {
        note(length > kMostBlockBytes ? "a record of " + std::to_string(length) + " bytes"
                                      : content.error().message);
      }
    }
    at += mcap::kRecordHead + length;
  }
  if (expansion.is_reached() && topics_.empty()) return ExpansionLimit::error(file_.path());
  if (expansion.is_reached()) {
    warnings_.push_back(ExpansionLimit::error(file_.path()).message);
  } else if (!ended) {
    warnings_.push_back(file_.path().string() + ": ends early, read as far as it goes");
  }
  warn_of_faults(file_.path().string());
  return Ok{};
}

}  // namespace ygslam
