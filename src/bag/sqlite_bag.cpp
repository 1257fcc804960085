#include "bag/sqlite_bag.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "bag/input_file.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

/// Of a bag and of what its writer did not get to put into it.
std::uint64_t bytes_on_disk(const fs::path& path) {
  std::uint64_t bytes = 0;
  for (const char* ending : {"", "-wal"}) {
    std::error_code code;
    const auto size = fs::file_size(path.string() + ending, code);
    if (!code) bytes += size;
  }
  return bytes;
}

/// Numbers of rows that only grow: pages that lead back to others give rows without end.
class Ascending {
 public:
  bool take(std::optional<std::int64_t> row) {
    if (!row || (last_ && *row <= *last_)) return false;
    last_ = row;
    return true;
  }

 private:
  std::optional<std::int64_t> last_;
};

std::span<const std::uint8_t> blob_at(const sqlite::Statement& rows, int column) {
  const auto bytes = rows.bytes(column).value_or(std::span<const char>());
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

constexpr std::array<std::uint8_t, 4> kZstdMagic = {0x28, 0xb5, 0x2f, 0xfd};

/// How rosbag2 compressed a message. CDR begins otherwise.
Compression compression_of(std::span<const std::uint8_t> bytes) {
  const bool is_packed = bytes.size() >= kZstdMagic.size() &&
                         std::equal(kZstdMagic.begin(), kZstdMagic.end(), bytes.begin());
  return is_packed ? Compression::kZstd : Compression::kNone;
}

/// A message as it was before it was compressed.
Result<Bytes> plain_message(std::span<const std::uint8_t> bytes) {
  const Compression compression = compression_of(bytes);
  return decompressed(compression, bytes, promised_size(compression, bytes));
}

/// Unpacks a message unless the file has come to too much with it.
std::optional<Result<Bytes>> unpack_within(std::span<const std::uint8_t> bytes,
                                           ExpansionLimit& expansion) {
  const Compression compression = compression_of(bytes);
  if (compression == Compression::kNone) return plain_message(bytes);
  const auto promised = promised_size(compression, bytes);
  // What is beyond the largest block is refused before anything is unpacked.
  if (promised && *promised <= kMostBlockBytes && !expansion.take(*promised)) return std::nullopt;
  auto message = plain_message(bytes);
  if (!promised && !expansion.take(message.ok() ? message->size() : kMostBlockBytes))
    return std::nullopt;
  return message;
}

}  // namespace

Result<std::unique_ptr<Bag>> SqliteBag::open(const fs::path& path) {
  using Access = sqlite::Database::Access;
  // Nothing is left beside the file, unless what its writer did not get to put into it lies there.
  std::error_code code;
  const bool has_log = fs::exists(path.string() + "-wal", code);
  auto database =
      sqlite::Database::open(path, has_log ? Access::kRead : Access::kReadAlone, ErrorKind::kInput);
  if (!database.ok()) return database.error();
  std::unique_ptr<SqliteBag> bag(new SqliteBag(path, std::move(*database)));
  if (Status read = bag->read_topics(); !read.ok()) return read.error();
  return std::unique_ptr<Bag>(std::move(bag));
}

Error SqliteBag::no_bag() const {
  return {ErrorKind::kInput, path_.string() + ": is no ROS 2 bag (" + database_.message() + ")"};
}

Status SqliteBag::read_topics() {
  auto rows = database_.prepare(
      "SELECT id, name, type, serialization_format, rowid FROM topics ORDER BY rowid");
  if (!rows) return no_bag();
  Ascending ascending;
  while (rows->next()) {
    database_.renew_patience();
    if (!ascending.take(rows->integer(4)))
      return Error{ErrorKind::kInput, path_.string() + ": damaged: its topics come again"};
    if (rows->text(3) != "cdr") continue;
    topic_of_[rows->integer(0).value_or(-1)] =
        add_topic(std::string(rows->text(1).value_or("")), std::string(rows->text(2).value_or("")),
                  Layout::kCdr);
  }
  return Ok{};
}

Status SqliteBag::visit(const Visitor& visitor, const Interrupted& interrupted) {
  auto rows =
      database_.prepare("SELECT rowid, topic_id, timestamp, data FROM messages ORDER BY rowid");
  if (!rows) return no_bag();
  Ascending ascending;
  ExpansionLimit expansion(bytes_on_disk(path_));
  bool came_again = false;
  while (rows->next()) {
    database_.renew_patience();
    if (interrupted && interrupted()) return interruption(path_);
    const auto row = rows->integer(0);
    came_again = !ascending.take(row);
    if (came_again) break;
    const auto topic = topic_of_.find(rows->integer(1).value_or(-1));
    if (topic == topic_of_.end()) continue;
    const auto unpacked = unpack_within(blob_at(*rows, 3), expansion);
    if (!unpacked) break;
    const auto& message = *unpacked;
    if (!message.ok()) {
      note(message.error().message);
      continue;
    }
    visitor({topic->second,
             {rows->integer(2).value_or(0)},
             *message,
             {0, static_cast<std::uint64_t>(*row), 0, 0}});
  }
  if (expansion.is_reached() && topics_.empty()) return ExpansionLimit::error(path_);
  if (expansion.is_reached()) {
    warnings_.push_back(ExpansionLimit::error(path_).message);
  } else if (came_again || rows->failed()) {
    warnings_.push_back(path_.string() + ": read as far as it goes (" +
                        (came_again ? "its messages come again" : database_.message()) + ")");
  }
  warn_of_faults(path_.string());
  return Ok{};
}

Result<Bytes> SqliteBag::read(const MessagePlace& place) const {
  const std::lock_guard lock(mutex_);
  database_.renew_patience();
  auto rows = database_.prepare("SELECT data FROM messages WHERE rowid = ?");
  if (!rows || !rows->bind(1, static_cast<std::int64_t>(place.block)).next())
    return Error{ErrorKind::kInput, database_.message()};
  return plain_message(blob_at(*rows, 0));
}

}  // namespace ygslam
