#include "bag/ros1_bag.hpp"

#include <algorithm>

namespace ygslam {
namespace {

constexpr std::uint64_t kMagicBytes = 13;  // #ROSBAG V2.0 and the end of the line
constexpr std::uint8_t kMessageOp = 0x02, kChunkOp = 0x05, kConnectionOp = 0x07;
constexpr std::size_t kMostConnections = 1'000'000;  // every publisher has its own, dead ones too

/// Fields `name=value` of a record's head or of a connection.
using Fields = std::map<std::string, std::string>;

Fields fields_of(std::span<const std::uint8_t> bytes) {
  Fields fields;
  RecordReader reader(bytes);
  while (reader.left() > 0) {
    const std::string field = reader.text();
    if (!reader.ok()) break;
    const std::size_t equals = field.find('=');
    if (equals != std::string::npos) fields[field.substr(0, equals)] = field.substr(equals + 1);
  }
  return fields;
}

/// A number of a field, little-endian; nothing where the field is missing or of another size.
template <typename T>
std::optional<T> number_of(const Fields& fields, const std::string& name) {
  const auto it = fields.find(name);
  if (it == fields.end() || it->second.size() != sizeof(T)) return std::nullopt;
  T value;
  std::memcpy(&value, it->second.data(), sizeof value);
  return value;
}

struct RecordPlace {
  Fields head;
  std::uint64_t data = 0, data_bytes = 0;  // offset in the file, length
};

/// The record at an offset. @return nothing where the file does not hold it whole.
std::optional<RecordPlace> record_at(const InputFile& file, std::uint64_t at) {
  constexpr std::uint64_t kMostHead = 1 << 16;
  const auto length_at = [&](std::uint64_t offset) -> std::optional<std::uint32_t> {
    const auto bytes = file.read(offset, sizeof(std::uint32_t));
    if (!bytes.ok()) return std::nullopt;
    return RecordReader(*bytes).number<std::uint32_t>();
  };
  const auto head_bytes = length_at(at);
  if (!head_bytes || *head_bytes > kMostHead) return std::nullopt;
  const auto head = file.read(at + 4, *head_bytes);
  if (!head.ok()) return std::nullopt;
  const auto data_bytes = length_at(at + 4 + *head_bytes);
  const std::uint64_t data = at + 8 + *head_bytes;
  if (!data_bytes || !file.holds(data, *data_bytes)) return std::nullopt;
  return RecordPlace{fields_of(*head), data, *data_bytes};
}

/// The records of a chunk.
Result<Bytes> load_chunk(const InputFile& file, const RecordPlace& record) {
  const auto name = record.head.find("compression");
  const auto size = number_of<std::uint32_t>(record.head, "size");
  if (name == record.head.end() || !size)
    return Error{ErrorKind::kInput, "a chunk without compression or size"};
  const Compression compression = name->second == "bz2"   ? Compression::kBz2
                                  : name->second == "lz4" ? Compression::kLz4
                                                          : Compression::kNone;
  if (compression == Compression::kNone && name->second != "none")
    return Error{ErrorKind::kInput, "chunks are compressed otherwise"};
  const auto packed = file.read(record.data, record.data_bytes);
  if (!packed.ok()) return packed.error();
  return decompressed(compression, *packed, *size);
}

/// What a chunk says that its records come to; 0 if they are not compressed or will be refused.
std::uint64_t expansion_of(const RecordPlace& record) {
  const auto name = record.head.find("compression");
  const auto size = number_of<std::uint32_t>(record.head, "size").value_or(0);
  const bool is_packed = name != record.head.end() && name->second != "none";
  return is_packed && size <= kMostBlockBytes ? size : 0;
}

}  // namespace

Ros1Bag::Ros1Bag(InputFile file)
    : file_(std::move(file)), blocks_([this](std::uint64_t offset) -> Result<Bytes> {
        const auto record = record_at(file_, offset);
        if (!record) return Error{ErrorKind::kInput, "the file changed while it was read"};
        return load_chunk(file_, *record);
      }) {}

Result<Bytes> Ros1Bag::read(const MessagePlace& place) const {
  return blocks_.read(place.block, place.offset, place.bytes);
}

Status Ros1Bag::visit(const Visitor& visitor, const Interrupted& interrupted) {
  std::uint64_t at = kMagicBytes;
  ExpansionLimit expansion(file_.size());
  while (at < file_.size()) {
    if (interrupted && interrupted()) return interruption(file_.path());
    const auto record = record_at(file_, at);
    // A head without a field: what was never written is zeros, perhaps without end.
    if (!record || record->head.empty()) {
      warnings_.push_back(file_.path().string() + ": ends early, read as far as it goes");
      break;
    }
    if (number_of<std::uint8_t>(record->head, "op") == kChunkOp) {
      if (!expansion.take(expansion_of(*record))) {
        if (topics_.empty()) return ExpansionLimit::error(file_.path());
        warnings_.push_back(ExpansionLimit::error(file_.path()).message);
        break;
      }
      const auto records = load_chunk(file_, *record);
      records.ok() ? visit_records(*records, at, visitor) : note(records.error().message);
    }
    at = record->data + record->data_bytes;
  }
  warn_of_faults(file_.path().string());
  return Ok{};
}

void Ros1Bag::visit_records(std::span<const std::uint8_t> records, std::uint64_t chunk,
                            const Visitor& visitor) {
  RecordReader reader(records);
  while (reader.left() > 0) {
    const Fields head = fields_of(reader.raw(reader.number<std::uint32_t>()));
    const auto bytes = reader.number<std::uint32_t>();
    const std::size_t offset = reader.at();
    const auto data = reader.raw(bytes);
    if (!reader.ok()) return note("a chunk's records do not fit into it");
    const auto op = number_of<std::uint8_t>(head, "op");
    const auto connection = number_of<std::uint32_t>(head, "conn");
    if (op == kConnectionOp && connection) {
      const Fields told = fields_of(data);
      const auto topic = head.find("topic");
      const auto type = told.find("type");
      if (topic != head.end() && type != told.end() && topic_of_.size() < kMostConnections)
        topic_of_.try_emplace(*connection, add_topic(topic->second, type->second, Layout::kRos1));
    } else if (op == kMessageOp && connection) {
      const auto topic = topic_of_.find(*connection);
      const auto time = number_of<std::uint64_t>(head, "time").value_or(0);  // s below, ns above
      const auto logged_ns = static_cast<std::int64_t>(time & 0xffffffff) * 1'000'000'000 +
                             static_cast<std::int64_t>(time >> 32);
      if (topic == topic_of_.end()) {
        note("a message of a connection that is not there");
      } else {
        visitor({topic->second, {logged_ns}, data, {0, chunk, offset, bytes}});
      }
    }
  }
}

}  // namespace ygslam
