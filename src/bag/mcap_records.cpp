#include "bag/mcap_records.hpp"

#include <zlib.h>

#include "bag/mcap_format.hpp"

namespace ygslam {
namespace {

std::optional<Compression> mcap_compression(const std::string& name) {
  if (name.empty()) return Compression::kNone;
  if (name == "zstd") return Compression::kZstd;
  if (name == "lz4") return Compression::kLz4;
  return std::nullopt;
}

struct McapChunk {
  std::uint64_t size;  // of the records
  std::uint32_t crc;   // 0: none
  Compression compression;
  std::span<const std::uint8_t> packed;
};

Result<McapChunk> chunk_of(std::span<const std::uint8_t> content) {
  RecordReader reader(content);
  reader.raw(2 * sizeof(std::uint64_t));  // first and last stamp
  const auto size = reader.number<std::uint64_t>();
  const auto crc = reader.number<std::uint32_t>();
  const std::string name = reader.text();
  const auto packed = reader.raw(reader.number<std::uint64_t>());
  if (!reader.ok()) return Error{ErrorKind::kInput, "a chunk is shorter than it says"};
  const auto compression = mcap_compression(name);
  if (!compression) return Error{ErrorKind::kInput, "chunks are compressed otherwise"};
  return McapChunk{size, crc, *compression, packed};
}

}  // namespace

std::uint64_t expansion_of_chunk(std::span<const std::uint8_t> content) {
  const auto chunk = chunk_of(content);
  // What is beyond this is refused before anything is unpacked.
  const bool is_unpacked =
      chunk.ok() && chunk->compression != Compression::kNone && chunk->size <= kMostBlockBytes;
  return is_unpacked ? chunk->size : 0;
}

Result<Bytes> unpacked_chunk(std::span<const std::uint8_t> content) {
  const auto chunk = chunk_of(content);
  if (!chunk.ok()) return chunk.error();
  const auto [size, crc, compression, packed] = *chunk;
  auto records = decompressed(compression, packed, size);
  if (!records.ok()) return records;
  if (crc != 0 && ::crc32_z(0, records->data(), records->size()) != crc)
    return Error{ErrorKind::kInput, "a chunk's checksum is wrong"};
  return records;
}

bool McapRecords::is_used(std::uint8_t opcode) {
  return opcode == mcap::kChunk || opcode == mcap::kMessage || opcode == mcap::kSchema ||
         opcode == mcap::kChannel;
}

bool McapRecords::is_end(std::uint8_t opcode, std::uint64_t length) const {
  if (opcode != mcap::kDataEnd && opcode != mcap::kFooter) return false;
  constexpr std::uint64_t kDataEndBytes = 4, kFooterBytes = 20;
  if (length == (opcode == mcap::kFooter ? kFooterBytes : kDataEndBytes)) return true;
  note_("a record that ends the messages, but not of its length");
  return false;
}

void McapRecords::take(std::uint8_t opcode, std::span<const std::uint8_t> content,
                       MessagePlace place, const MessageVisitor& visitor) {
  if (opcode != mcap::kChunk) return take_one(opcode, content, place, visitor);
  const auto records = unpacked_chunk(content);
  records.ok() ? take_chunk(*records, place.block, visitor) : note_(records.error().message);
}

void McapRecords::take_chunk(std::span<const std::uint8_t> records, std::uint64_t chunk,
                             const MessageVisitor& visitor) {
  RecordReader reader(records);
  while (reader.left() > 0) {
    const auto opcode = reader.number<std::uint8_t>();
    const auto length = reader.number<std::uint64_t>();
    const std::size_t offset = reader.at();
    const auto content = reader.raw(length);
    // No record has the number 0: zeros would be looked at nine by nine.
    if (!reader.ok() || opcode == 0) return note_("a chunk's records do not fit into it");
    take_one(opcode, content, {0, chunk, offset, length}, visitor);
  }
}

void McapRecords::take_one(std::uint8_t opcode, std::span<const std::uint8_t> content,
                           MessagePlace place, const MessageVisitor& visitor) {
  RecordReader reader(content);
  if (opcode == mcap::kSchema) {
    const auto id = reader.number<std::uint16_t>();
    std::string type = cut_name(reader.text());
    if (reader.ok()) type_of_[id] = std::move(type);
  } else if (opcode == mcap::kChannel) {
    add_channel(content);
  } else if (opcode == mcap::kMessage) {
    const auto channel = topic_of_.find(reader.number<std::uint16_t>());
    reader.number<std::uint32_t>();  // count
    const auto logged_ns = reader.number<std::uint64_t>();
    reader.number<std::uint64_t>();  // published
    if (!reader.ok()) return note_("a message is shorter than its head");
    if (channel == topic_of_.end()) return note_("a message of a channel that is not there");
    if (!channel->second) return;
    place.offset += reader.at();
    place.bytes -= reader.at();
    visitor({*channel->second,
             {static_cast<std::int64_t>(logged_ns)},
             reader.raw(reader.left()),
             place});
  }
}

void McapRecords::add_channel(std::span<const std::uint8_t> content) {
  RecordReader reader(content);
  const auto id = reader.number<std::uint16_t>();
  const auto type = type_of_.find(reader.number<std::uint16_t>());
  const std::string topic = reader.text();
  const std::string encoding = reader.text();
  if (!reader.ok()) return note_("a channel is shorter than it says");
  const auto [place, is_new] = topic_of_.try_emplace(id);
  if (!is_new || type == type_of_.end()) return;
  if (encoding == "cdr") place->second = add_topic_(topic, type->second, Layout::kCdr);
  if (encoding == "ros1") place->second = add_topic_(topic, type->second, Layout::kRos1);
  if (!place->second && shows_images(type->second))  // to be named where others are missing
    place->second = add_topic_(topic, type->second + " as " + encoding, Layout::kOther);
}

}  // namespace ygslam
