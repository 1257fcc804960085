// SQLite, as far as maps and bags need it. Want of memory throws std::bad_alloc; every other fault
// is an error of the statement or the database that it met.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace ygslam::sqlite {

/// One SQL statement, to be run any number of times. Must not outlive its database.
class Statement {
 public:
  Statement(sqlite3_stmt* handle) : handle_(handle) {}  // NOLINT: made by Database alone

  // Values for its question marks, counted from 1. Bytes and text must live until it has run.
  Statement& bind(int place, std::int64_t value);
  Statement& bind(int place, std::span<const char> bytes);
  Statement& bind_text(int place, std::string_view text);
  /// @return true if there is a row; false at the end or after a fault, see failed().
  bool next();
  /// Runs it to its end and makes it ready for the next time. @return false after a fault.
  bool run();
  void reset();
  [[nodiscard]] bool failed() const { return failed_; }

  // Columns of the row, counted from 0. Nothing where the column is of another type. Bytes and
  // text live until the statement goes on.
  [[nodiscard]] std::optional<std::int64_t> integer(int column) const;
  [[nodiscard]] std::optional<std::span<const char>> bytes(int column) const;
  [[nodiscard]] std::optional<std::string_view> text(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* handle) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalize> handle_;
  bool failed_ = false;
};

class Database {
 public:
  enum class Access {
    kRead,       ///< with every care for files of others
    kReadAlone,  ///< the same of a file that nobody writes: leaves nothing beside it
    kWrite,
    kCreate,
  };
  /// @param unreadable what a file that cannot be read is.
  static Result<Database> open(const std::filesystem::path& path, Access access,
                               ErrorKind unreadable = ErrorKind::kSavedMap);
  /// Reading may take so many instructions again; a damaged file must not keep it busy without end.
  void renew_patience();

  /// From now on a file that is shorter than it says is read as far as it goes. @return false
  /// after a fault.
  bool read_cut_short();
  /// Runs one or more statements without results. @return false after a fault.
  bool run(const char* sql);
  /// @return nothing after a fault.
  std::optional<Statement> prepare(std::string_view sql);
  /// The first bytes of the file as they lie there. Through SQLite: whoever opens and closes the
  /// file by himself takes its locks from every other connection of the process.
  /// @return how many there are; nothing after a fault.
  std::optional<std::size_t> read_start(std::span<unsigned char> bytes) const;
  /// The last fault, with the system's reason where there is one.
  [[nodiscard]] std::string message() const;
  /// Whether the last fault was that something beside the file cannot be opened or made.
  [[nodiscard]] bool lacks_access() const;
  /// Closes it. @return false if something could not be written.
  bool close();

 private:
  explicit Database(sqlite3* handle) : handle_(handle) {}
  Status protect(const std::filesystem::path& path, bool reads);
  struct Close {
    void operator()(sqlite3* handle) const;
  };
  std::unique_ptr<int> times_left_;  // that a busy statement is let go on; before handle_
  std::unique_ptr<sqlite3, Close> handle_;
};

}  // namespace ygslam::sqlite
