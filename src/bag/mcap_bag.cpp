#include "bag/mcap_bag.hpp"

#include <zlib.h>

#include "bag/mcap_format.hpp"

namespace ygslam {
namespace {

constexpr std::uint64_t kRecordHead = 9;  // opcode and length

std::optional<Compression> mcap_compression(const std::string& name) {
  if (name.empty()) return Compression::kNone;
  if (name == "zstd") return Compression::kZstd;
  if (name == "lz4") return Compression::kLz4;
  return std::nullopt;
}

/// A chunk's records.
Result<Bytes> unpacked_chunk(std::span<const std::uint8_t> content) {
  RecordReader reader(content);
  reader.raw(2 * sizeof(std::uint64_t));  // first and last stamp
  const auto size = reader.number<std::uint64_t>();
  const auto crc = reader.number<std::uint32_t>();
  const std::string name = reader.text();
  const auto packed = reader.raw(reader.number<std::uint64_t>());
  if (!reader.ok()) return Error{ErrorKind::kInput, "a chunk is shorter than it says"};
  const auto compression = mcap_compression(name);
  if (!compression) return Error{ErrorKind::kInput, "chunks are compressed otherwise"};
  auto records = decompressed(*compression, packed, size);
  if (!records.ok()) return records;
  if (crc != 0 && ::crc32_z(0, records->data(), records->size()) != crc)
    return Error{ErrorKind::kInput, "a chunk's checksum is wrong"};
  return records;
}

/// The content of the record at `offset`; a chunk's is unpacked.
Result<Bytes> load_record(const InputFile& file, std::uint64_t offset) {
  const auto head = file.read(offset, kRecordHead);
  if (!head.ok()) return head.error();
  RecordReader reader(*head);
  const auto opcode = reader.number<std::uint8_t>();
  auto content = file.read(offset + kRecordHead, reader.number<std::uint64_t>());
  if (!content.ok() || opcode != mcap::kChunk) return content;
  return unpacked_chunk(*content);
}

}  // namespace

McapBag::McapBag(InputFile file)
    : file_(std::move(file)),
      blocks_([this](std::uint64_t offset) { return load_record(file_, offset); }) {}

Result<Bytes> McapBag::read(const MessagePlace& place) const {
  return blocks_.read(place.block, place.offset, place.bytes);
}

Status McapBag::visit(const Visitor& visitor) {
  std::uint64_t at = mcap::kMagic.size();
  bool ended = false;
  while (!ended && file_.holds(at, kRecordHead)) {
    const auto head = file_.read(at, kRecordHead);
    if (!head.ok())
      return Error{ErrorKind::kInput, file_.path().string() + ": " + head.error().message};
    RecordReader reader(*head);
    const auto opcode = reader.number<std::uint8_t>();
    const auto length = reader.number<std::uint64_t>();
    if (length > file_.size() - at - kRecordHead) break;
    ended = opcode == mcap::kDataEnd || opcode == mcap::kFooter;
    const bool is_used = opcode == mcap::kChunk || opcode == mcap::kMessage ||
                         opcode == mcap::kSchema || opcode == mcap::kChannel;
    if (is_used) {
      const auto content = file_.read(at + kRecordHead, length);
      if (!content.ok()) {
        note(length > kMostBlockBytes ? "a record of " + std::to_string(length) + " bytes"
                                      : content.error().message);
      } else if (opcode == mcap::kChunk) {
        const auto records = unpacked_chunk(*content);
        records.ok() ? visit_records(*records, at, visitor) : note(records.error().message);
      } else {
        take_record(opcode, *content, {0, at, 0, length}, visitor);
      }
    }
    at += kRecordHead + length;
  }
  if (!ended) warnings_.push_back(file_.path().string() + ": ends early, read as far as it goes");
  warn_of_faults(file_.path());
  return Ok{};
}

void McapBag::visit_records(std::span<const std::uint8_t> records, std::uint64_t chunk,
                            const Visitor& visitor) {
  RecordReader reader(records);
  while (reader.left() > 0) {
    const auto opcode = reader.number<std::uint8_t>();
    const auto length = reader.number<std::uint64_t>();
    const std::size_t offset = reader.at();
    const auto content = reader.raw(length);
    if (!reader.ok()) return note("a chunk's records do not fit into it");
    take_record(opcode, content, {0, chunk, offset, length}, visitor);
  }
}

void McapBag::take_record(std::uint8_t opcode, std::span<const std::uint8_t> content,
                          MessagePlace place, const Visitor& visitor) {
  RecordReader reader(content);
  if (opcode == mcap::kSchema) {
    const auto id = reader.number<std::uint16_t>();
    Schema schema{reader.text(), reader.text()};
    if (reader.ok()) schemas_[id] = std::move(schema);
  } else if (opcode == mcap::kChannel) {
    add_channel(content);
  } else if (opcode == mcap::kMessage) {
    const auto channel = topic_of_.find(reader.number<std::uint16_t>());
    reader.number<std::uint32_t>();  // count
    const auto logged_ns = reader.number<std::uint64_t>();
    reader.number<std::uint64_t>();  // published
    if (!reader.ok()) return note("a message is shorter than its head");
    if (channel == topic_of_.end()) return note("a message of a channel that is not there");
    if (!channel->second) return;
    place.offset += reader.at();
    place.bytes -= reader.at();
    visitor({*channel->second,
             {static_cast<std::int64_t>(logged_ns)},
             reader.raw(reader.left()),
             place});
  }
}

void McapBag::add_channel(std::span<const std::uint8_t> content) {
  RecordReader reader(content);
  const auto id = reader.number<std::uint16_t>();
  const auto schema = schemas_.find(reader.number<std::uint16_t>());
  const std::string topic = reader.text();
  const std::string encoding = reader.text();
  if (!reader.ok()) return note("a channel is shorter than it says");
  const auto [place, is_new] = topic_of_.try_emplace(id);
  if (!is_new || schema == schemas_.end()) return;
  if (encoding == "cdr") place->second = add_topic(topic, schema->second.name, Layout::kCdr);
  if (encoding == "ros1") place->second = add_topic(topic, schema->second.name, Layout::kRos1);
}

}  // namespace ygslam
