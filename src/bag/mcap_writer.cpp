#include "bag/mcap_writer.hpp"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>

#include "bag/mcap_format.hpp"
#include "core/check.hpp"

namespace ygslam {
namespace {

using namespace mcap;  // NOLINT: the format's words

constexpr std::size_t kChunkBytes = 1 << 20;
constexpr int kLevel = 1;  // images are compressed already

std::uint32_t crc(const Bytes& bytes) {
  return static_cast<std::uint32_t>(::crc32(0, bytes.data(), static_cast<unsigned>(bytes.size())));
}

Bytes compressed(const Bytes& bytes) {
  Bytes out(::ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ::ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kLevel);
  CHECK(!::ZSTD_isError(size), "zstd compresses into its own bound");
  out.resize(size);
  return out;
}

// As kMagic, in characters.
constexpr FileKind kKind{"recording", {"\x89MCAP0\r\n", kMagic.size()}};

}  // namespace

McapWriter::McapWriter(std::filesystem::path path, FilePtr file)
    : path_(std::move(path)), file_(std::move(file)) {}

Status McapWriter::check(const std::filesystem::path& path) {
  return check_growing_file(path, kKind);
}

Result<McapWriter> McapWriter::create(const std::filesystem::path& path) {
  auto file = create_growing_file(path, kKind);
  if (!file.ok()) return file.error();
  McapWriter writer(path, std::move(file).value());
  Bytes head(kMagic.begin(), kMagic.end());
  append(head, Record(kHeader).text("ros2").text("ygslam").bytes());
  if (Status put = writer.put(head); !put.ok()) return put.error();
  return writer;
}

Status McapWriter::put(const Bytes& bytes) {
  if (failed_) return *failed_;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) {
    failed_ = Error{ErrorKind::kOutput, path_.string() + ": " + std::strerror(errno)};
    return *failed_;
  }
  at_ += bytes.size();
  return Ok{};
}

std::uint16_t McapWriter::add_channel(const std::string& topic, const std::string& type) {
  const auto [schema, is_new] =
      schema_of_.try_emplace(type, static_cast<std::uint16_t>(schema_of_.size() + 1));
  if (is_new)
    schemas_.push_back(Record(kSchema)
                           .number(schema->second)
                           .text(type)
                           .text("ros2msg")
                           .text(ros::schema_of(type))
                           .bytes());
  const auto channel = static_cast<std::uint16_t>(channel_of_.size() + 1);
  channel_of_[topic] = channel;
  channels_.push_back(Record(kChannel)
                          .number(channel)
                          .number(schema->second)
                          .text(topic)
                          .text("cdr")
                          .number(std::uint32_t{0})
                          .bytes());
  if (is_new) append(chunk_, schemas_.back());
  append(chunk_, channels_.back());
  return channel;
}

Status McapWriter::write(const std::string& topic, const std::string& type, Timestamp stamp,
                         const Bytes& cdr) {
  const auto known = channel_of_.find(topic);
  const std::uint16_t channel =
      known == channel_of_.end() ? add_channel(topic, type) : known->second;
  const auto count = static_cast<std::uint32_t>(counts_[channel]++);
  chunk_index_[channel].push_back({stamp.ns, chunk_.size()});
  append(chunk_, Record(kMessage)
                     .number(channel)
                     .number(count)
                     .number(stamp.ns)
                     .number(stamp.ns)
                     .raw(cdr)
                     .bytes());
  return chunk_.size() < kChunkBytes ? Status(Ok{}) : close_chunk();
}

Status McapWriter::close_chunk() {
  if (chunk_.empty()) return failed_ ? Status(*failed_) : Status(Ok{});
  ChunkPlace place{std::numeric_limits<std::int64_t>::max(), 0, at_, 0, 0, 0, chunk_.size(), {}};
  for (const auto& [channel, entries] : chunk_index_) {
    for (const Entry& entry : entries) {
      place.first_ns = std::min(place.first_ns, entry.ns);
      place.last_ns = std::max(place.last_ns, entry.ns);
    }
  }
  if (chunk_index_.empty()) place.first_ns = 0;
  const Bytes packed = compressed(chunk_);
  place.compressed = packed.size();
  const Bytes chunk = Record(kChunk)
                          .number(place.first_ns)
                          .number(place.last_ns)
                          .number(place.uncompressed)
                          .number(crc(chunk_))
                          .text("zstd")
                          .number(place.compressed)
                          .raw(packed)
                          .bytes();
  place.bytes = chunk.size();
  Bytes out = chunk;
  for (const auto& [channel, entries] : chunk_index_) {
    place.index_offsets[channel] = at_ + out.size();
    Record index(kMessageIndex);
    index.number(channel).number(static_cast<std::uint32_t>(entries.size() * 16));
    for (const Entry& entry : entries) index.number(entry.ns).number(entry.offset);
    append(out, index.bytes());
  }
  place.index_bytes = out.size() - chunk.size();
  chunk_.clear();
  chunk_index_.clear();
  chunks_.push_back(std::move(place));
  return put(out);
}

Status McapWriter::flush() {
  if (Status closed = close_chunk(); !closed.ok()) return closed;
  if (std::fflush(file_.get()) != 0)
    failed_ = Error{ErrorKind::kOutput, path_.string() + ": " + std::strerror(errno)};
  return failed_ ? Status(*failed_) : Status(Ok{});
}

Status McapWriter::finish() {
  if (Status closed = close_chunk(); !closed.ok()) return closed;
  Bytes end = Record(kDataEnd).number(std::uint32_t{0}).bytes();
  const std::uint64_t summary = at_ + end.size();
  for (const Bytes& schema : schemas_) append(end, schema);
  for (const Bytes& channel : channels_) append(end, channel);
  std::uint64_t messages = 0;
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max(), last_ns = 0;
  for (const ChunkPlace& chunk : chunks_) {
    Record index(kChunkIndex);
    index.number(chunk.first_ns).number(chunk.last_ns).number(chunk.offset).number(chunk.bytes);
    index.number(static_cast<std::uint32_t>(chunk.index_offsets.size() * 10));
    for (const auto& [channel, offset] : chunk.index_offsets) index.number(channel).number(offset);
    index.number(chunk.index_bytes).text("zstd").number(chunk.compressed);
    append(end, index.number(chunk.uncompressed).bytes());
    first_ns = std::min(first_ns, chunk.first_ns);
    last_ns = std::max(last_ns, chunk.last_ns);
  }
  for (const auto& [channel, count] : counts_) messages += count;
  Record statistics(kStatistics);
  statistics.number(messages)
      .number(static_cast<std::uint16_t>(schemas_.size()))
      .number(static_cast<std::uint32_t>(channels_.size()))
      .number(std::uint32_t{0})  // attachments, metadata
      .number(std::uint32_t{0})
      .number(static_cast<std::uint32_t>(chunks_.size()))
      .number(chunks_.empty() ? 0 : first_ns)
      .number(last_ns)
      .number(static_cast<std::uint32_t>(counts_.size() * 10));
  for (const auto& [channel, count] : counts_) statistics.number(channel).number(count);
  append(end, statistics.bytes());
  append(end,
         Record(kFooter).number(summary).number(std::uint64_t{0}).number(std::uint32_t{0}).bytes());
  end.insert(end.end(), kMagic.begin(), kMagic.end());
  if (Status written = put(end); !written.ok()) return written;
  return flush();
}

}  // namespace ygslam
