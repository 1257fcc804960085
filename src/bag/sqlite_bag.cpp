#include "bag/sqlite_bag.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <optional>

#include "bag/input_file.hpp"
#include "io/text.hpp"

namespace ygslam {
namespace fs = std::filesystem;
namespace {

// SQLite quotes the file, which is somebody else's.
std::string said_by(sqlite3* handle) { return printable(sqlite3_errmsg(handle)); }

// Of SQLite's machine, from row to row: a damaged file must not keep it busy without end.
constexpr int kMostInstructions = 10'000'000;
constexpr int kInstructionsAtOnce = 1'000'000;

/// A path as SQLite's URIs spell it.
std::string uri_of_bag(const fs::path& path) {
  std::string uri = "file://";  // of no host, however many slashes the path begins with
  for (const char c : fs::absolute(path).string()) {
    if (std::string_view("%?#").find(c) == std::string_view::npos) {
      uri += c;
    } else {
      uri += c == '%' ? "%25" : c == '?' ? "%3f" : "%23";
    }
  }
  // Nothing is left beside the file, unless what its writer did not get to put into it lies there.
  std::error_code code;
  return uri + (fs::exists(path.string() + "-wal", code) ? "" : "?immutable=1");
}

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

struct FinalizeRows {
  void operator()(sqlite3_stmt* rows) const { sqlite3_finalize(rows); }
};
using Rows = std::unique_ptr<sqlite3_stmt, FinalizeRows>;

Rows prepare_rows(sqlite3* handle, const char* sql) {
  sqlite3_stmt* rows = nullptr;
  sqlite3_prepare_v2(handle, sql, -1, &rows, nullptr);
  return Rows(rows);
}

/// Lets a statement take so many instructions from row to row, as long as it lives.
class Patience {
 public:
  explicit Patience(sqlite3* handle) : handle_(handle) {
    sqlite3_progress_handler(
        handle_, kInstructionsAtOnce,
        [](void* times) { return (*static_cast<int*>(times))-- <= 0 ? 1 : 0; }, &left_);
  }
  Patience(const Patience&) = delete;
  Patience& operator=(const Patience&) = delete;
  ~Patience() { sqlite3_progress_handler(handle_, 0, nullptr, nullptr); }
  int step(sqlite3_stmt* rows) {
    left_ = kMostInstructions / kInstructionsAtOnce;
    return sqlite3_step(rows);
  }

 private:
  sqlite3* handle_;
  int left_ = 0;
};

/// Numbers of rows that only grow: pages that lead back to others give rows without end.
class Ascending {
 public:
  bool take(sqlite3_int64 row) {
    if (last_ && row <= *last_) return false;
    last_ = row;
    return true;
  }

 private:
  std::optional<sqlite3_int64> last_;
};

std::string text_at(sqlite3_stmt* rows, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(rows, column));
  return text == nullptr ? "" : text;
}

std::span<const std::uint8_t> blob_at(sqlite3_stmt* rows, int column) {
  const auto* data = static_cast<const std::uint8_t*>(sqlite3_column_blob(rows, column));
  return {data, data == nullptr ? 0 : static_cast<std::size_t>(sqlite3_column_bytes(rows, column))};
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

void SqliteBag::Close::operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }

Result<std::unique_ptr<Bag>> SqliteBag::open(const fs::path& path) {
  std::unique_ptr<SqliteBag> bag(new SqliteBag(path));
  sqlite3* handle = nullptr;
  const int code =
      sqlite3_open_v2(uri_of_bag(path).c_str(), &handle,
                      SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
  bag->handle_.reset(handle);
  if (code != SQLITE_OK) return Error{ErrorKind::kInput, path.string() + ": " + said_by(handle)};
  // What SQLite's manual asks for where a file comes from somebody else (sqlite.org/security.html).
  constexpr std::array<std::pair<int, int>, 4> kOptions = {{{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                                            {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                                            {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                                            {SQLITE_DBCONFIG_ENABLE_VIEW, 0}}};
  for (const auto& [option, value] : kOptions) sqlite3_db_config(handle, option, value, nullptr);
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, static_cast<int>(kMostBlockBytes));
  if (Status read = bag->read_topics(); !read.ok()) return read.error();
  return std::unique_ptr<Bag>(std::move(bag));
}

Status SqliteBag::read_topics() {
  const Rows rows =
      prepare_rows(handle_.get(),
                   "SELECT id, name, type, serialization_format, rowid FROM topics ORDER BY rowid");
  if (!rows)
    return Error{ErrorKind::kInput,
                 path_.string() + ": is no ROS 2 bag (" + said_by(handle_.get()) + ")"};
  Patience patience(handle_.get());
  Ascending ascending;
  while (patience.step(rows.get()) == SQLITE_ROW) {
    if (!ascending.take(sqlite3_column_int64(rows.get(), 4)))
      return Error{ErrorKind::kInput, path_.string() + ": damaged: its topics come again"};
    if (text_at(rows.get(), 3) != "cdr") continue;
    topic_of_[sqlite3_column_int64(rows.get(), 0)] =
        add_topic(text_at(rows.get(), 1), text_at(rows.get(), 2), Layout::kCdr);
  }
  return Ok{};
}

Status SqliteBag::visit(const Visitor& visitor, const Interrupted& interrupted) {
  const Rows rows = prepare_rows(
      handle_.get(), "SELECT rowid, topic_id, timestamp, data FROM messages ORDER BY rowid");
  if (!rows)
    return Error{ErrorKind::kInput,
                 path_.string() + ": is no ROS 2 bag (" + said_by(handle_.get()) + ")"};
  Patience patience(handle_.get());
  Ascending ascending;
  ExpansionLimit expansion(bytes_on_disk(path_));
  int code = SQLITE_ROW;
  while ((code = patience.step(rows.get())) == SQLITE_ROW) {
    if (interrupted && interrupted()) return interruption(path_);
    if (!ascending.take(sqlite3_column_int64(rows.get(), 0))) break;
    const auto topic = topic_of_.find(sqlite3_column_int64(rows.get(), 1));
    if (topic == topic_of_.end()) continue;
    const auto unpacked = unpack_within(blob_at(rows.get(), 3), expansion);
    if (!unpacked) break;
    const auto& message = *unpacked;
    if (!message.ok()) {
      note(message.error().message);
      continue;
    }
    const auto row = static_cast<std::uint64_t>(sqlite3_column_int64(rows.get(), 0));
    visitor({topic->second, {sqlite3_column_int64(rows.get(), 2)}, *message, {0, row, 0, 0}});
  }
  if (expansion.is_reached() && topics_.empty()) return ExpansionLimit::error(path_);
  if (expansion.is_reached()) {
    warnings_.push_back(ExpansionLimit::error(path_).message);
  } else if (code != SQLITE_DONE) {
    warnings_.push_back(path_.string() + ": read as far as it goes (" +
                        (code == SQLITE_ROW ? "its messages come again" : said_by(handle_.get())) +
                        ")");
  }
  warn_of_faults(path_.string());
  return Ok{};
}

Result<Bytes> SqliteBag::read(const MessagePlace& place) const {
  const std::lock_guard lock(mutex_);
  const Rows rows = prepare_rows(handle_.get(), "SELECT data FROM messages WHERE rowid = ?");
  if (!rows || sqlite3_bind_int64(rows.get(), 1, static_cast<std::int64_t>(place.block)) != 0 ||
      sqlite3_step(rows.get()) != SQLITE_ROW)
    return Error{ErrorKind::kInput, said_by(handle_.get())};
  return plain_message(blob_at(rows.get(), 0));
}

}  // namespace ygslam
