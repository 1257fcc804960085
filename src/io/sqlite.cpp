#include "io/sqlite.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <new>

#include "io/text.hpp"

namespace ygslam::sqlite {
namespace fs = std::filesystem;
namespace {

constexpr int kLongestValue_bytes = 1 << 29;  // a message of a bag
constexpr int kLongestSql_bytes = 100'000;
constexpr int kPatience_ms = 2000;
// A damaged file must not keep a statement busy without end: reading a map takes some 20
// instructions of SQLite's machine a row.
constexpr int kInstructionsAtOnce = 100'000;
constexpr int kMostTimes = 1000;

/// A path as SQLite's URIs spell it.
std::string uri_of(const fs::path& path, bool immutable) {
  static constexpr std::string_view kHex = "0123456789abcdef";
  static constexpr std::string_view kPlain = "/-_.~";
  std::string uri = "file://";  // of no host, however many slashes the path begins with
  for (const char c : fs::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (letter || kPlain.find(c) != std::string_view::npos) {
      uri += c;
    } else {
      uri += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return uri + (immutable ? "?immutable=1" : "");
}

int count_down(void* left) {
  auto& times = *static_cast<int*>(left);
  return times-- <= 0 ? 1 : 0;
}

void require_no_want(int code) {
  if ((code & 0xff) == SQLITE_NOMEM) throw std::bad_alloc();
}

}  // namespace

void Statement::Finalize::operator()(sqlite3_stmt* handle) const { sqlite3_finalize(handle); }

Statement& Statement::bind(int place, std::int64_t value) {
  require_no_want(sqlite3_bind_int64(handle_.get(), place, value));
  return *this;
}

Statement& Statement::bind(int place, std::span<const char> bytes) {
  require_no_want(
      sqlite3_bind_blob64(handle_.get(), place, bytes.data(), bytes.size(), SQLITE_STATIC));
  return *this;
}

Statement& Statement::bind_text(int place, std::string_view text) {
  require_no_want(sqlite3_bind_text64(handle_.get(), place, text.data(), text.size(), SQLITE_STATIC,
                                      SQLITE_UTF8));
  return *this;
}

bool Statement::next() {
  const int code = sqlite3_step(handle_.get());
  require_no_want(code);
  failed_ = code != SQLITE_ROW && code != SQLITE_DONE;
  return code == SQLITE_ROW;
}

bool Statement::run() {
  while (next()) {
  }
  const bool ok = !failed_;
  if (ok) reset();  // after a fault the database's message is still wanted
  return ok;
}

void Statement::reset() {
  sqlite3_reset(handle_.get());
  sqlite3_clear_bindings(handle_.get());
}

std::optional<std::int64_t> Statement::integer(int column) const {
  if (sqlite3_column_type(handle_.get(), column) != SQLITE_INTEGER) return std::nullopt;
  return sqlite3_column_int64(handle_.get(), column);
}

std::optional<std::span<const char>> Statement::bytes(int column) const {
  if (sqlite3_column_type(handle_.get(), column) != SQLITE_BLOB) return std::nullopt;
  const auto* data = static_cast<const char*>(sqlite3_column_blob(handle_.get(), column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column));
  if (data == nullptr && size > 0) throw std::bad_alloc();
  return std::span(data, size);
}

std::optional<std::string_view> Statement::text(int column) const {
  if (sqlite3_column_type(handle_.get(), column) != SQLITE_TEXT) return std::nullopt;
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(handle_.get(), column));
  if (data == nullptr) throw std::bad_alloc();
  return std::string_view(data,
                          static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column)));
}

void Database::Close::operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }

Result<Database> Database::open(const fs::path& path, Access access, ErrorKind unreadable) {
  const bool reads = access == Access::kRead || access == Access::kReadAlone;
  int flags = SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  flags |= reads ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE;
  if (access == Access::kCreate) flags |= SQLITE_OPEN_CREATE;
  sqlite3* handle = nullptr;
  const int code =
      sqlite3_open_v2(uri_of(path, access == Access::kReadAlone).c_str(), &handle, flags, nullptr);
  Database database(handle);
  require_no_want(code);
  const ErrorKind kind = reads ? unreadable : ErrorKind::kOutput;
  if (code != SQLITE_OK) return Error{kind, path.string() + ": " + database.message()};
  if (Status safe = database.protect(path, reads); !safe) return safe.error();
  return database;
}

/// What SQLite's manual asks for where a file comes from somebody else (sqlite.org/security.html).
Status Database::protect(const fs::path& path, bool reads) {
  sqlite3* const db = handle_.get();
  constexpr std::array<std::pair<int, int>, 4> kOptions = {{{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                                            {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                                            {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                                            {SQLITE_DBCONFIG_ENABLE_VIEW, 0}}};
  for (const auto& [option, value] : kOptions) {
    if (sqlite3_db_config(db, option, value, nullptr) != SQLITE_OK)
      return Error{ErrorKind::kInternal, path.string() + ": this SQLite cannot be protected"};
  }
  sqlite3_limit(db, SQLITE_LIMIT_LENGTH, kLongestValue_bytes);
  sqlite3_limit(db, SQLITE_LIMIT_SQL_LENGTH, kLongestSql_bytes);
  sqlite3_limit(db, SQLITE_LIMIT_ATTACHED, 0);
  sqlite3_limit(db, SQLITE_LIMIT_TRIGGER_DEPTH, 1);
  sqlite3_limit(db, SQLITE_LIMIT_COLUMN, 16);
  sqlite3_busy_timeout(db, kPatience_ms);
  if (reads) {
    times_left_ = std::make_unique<int>(kMostTimes);
    sqlite3_progress_handler(db, kInstructionsAtOnce, count_down, times_left_.get());
  }
  return Ok{};
}

void Database::renew_patience() {
  if (times_left_) *times_left_ = kMostTimes;
}

bool Database::read_cut_short() {
  // SQLite counts the pages that are there in place of those that the header tells of where the
  // schema may be written, which it may only without its defence (of writing: this reads).
  sqlite3* const db = handle_.get();
  return sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr) == SQLITE_OK &&
         sqlite3_db_config(db, SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, nullptr) == SQLITE_OK;
}

bool Database::run(const char* sql) {
  const int code = sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr);
  require_no_want(code);
  return code == SQLITE_OK;
}

std::optional<Statement> Database::prepare(std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v2(handle_.get(), sql.data(), static_cast<int>(sql.size()),
                                      &statement, nullptr);
  require_no_want(code);
  if (code != SQLITE_OK) return std::nullopt;
  return std::optional<Statement>(std::in_place, statement);
}

std::optional<std::size_t> Database::read_start(std::span<unsigned char> bytes) const {
  sqlite3_file* file = nullptr;
  sqlite3_int64 size = 0;
  if (sqlite3_file_control(handle_.get(), "main", SQLITE_FCNTL_FILE_POINTER, &file) != SQLITE_OK ||
      file == nullptr || file->pMethods == nullptr ||
      file->pMethods->xFileSize(file, &size) != SQLITE_OK)
    return std::nullopt;
  const auto wanted = static_cast<int>(std::min(static_cast<sqlite3_int64>(bytes.size()), size));
  if (wanted > 0 && file->pMethods->xRead(file, bytes.data(), wanted, 0) != SQLITE_OK)
    return std::nullopt;
  return static_cast<std::size_t>(wanted);
}

std::string Database::message() const {
  sqlite3* const db = handle_.get();
  std::string text = printable(sqlite3_errmsg(db));  // which may quote the file
  const int system = sqlite3_system_errno(db);
  const int code = sqlite3_errcode(db) & 0xff;
  if (system != 0 && (code == SQLITE_IOERR || code == SQLITE_CANTOPEN || code == SQLITE_FULL))
    text += std::string(": ") + std::strerror(system);
  return text;
}

bool Database::lacks_access() const {
  const int code = sqlite3_errcode(handle_.get()) & 0xff;
  return code == SQLITE_CANTOPEN || code == SQLITE_READONLY || code == SQLITE_PERM;
}

bool Database::close() {
  const int code = sqlite3_close(handle_.get());
  if (code == SQLITE_OK) (void)handle_.release();
  return code == SQLITE_OK;
}

}  // namespace ygslam::sqlite
