#include "map_file/open_map.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <set>

#include <fmt/format.h>

#include "map_file/row_hash.hpp"

namespace ygslam::map_file {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kHeader_bytes = 100;  // of an SQLite file
constexpr std::size_t kMostMetaEntries = 100;

Error fault(const fs::path& path, const std::string& what) {
  return {ErrorKind::kSavedMap, path.string() + ": " + what};
}

std::uint32_t big_endian(const std::array<unsigned char, kHeader_bytes>& header, std::size_t at) {
  return (std::uint32_t{header[at]} << 24) | (std::uint32_t{header[at + 1]} << 16) |
         (std::uint32_t{header[at + 2]} << 8) | header[at + 3];
}

std::string short_text(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string plain;
  for (const char c : text.substr(0, kLongest)) plain += c >= ' ' && c <= '~' ? c : '?';
  return plain;
}

/// What SQLite's header says, read without SQLite: it reports less, and a pipe would not let go.
struct FileHeader {
  std::uint64_t bytes = 0;
  std::uint32_t format = 0;
};
Result<FileHeader> read_header(const fs::path& path, bool has_log) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (descriptor < 0) return fault(path, std::strerror(errno));
  struct stat status {};
  std::array<unsigned char, kHeader_bytes> header{};
  const bool known = ::fstat(descriptor, &status) == 0;
  const bool regular = known && S_ISREG(status.st_mode);
  const ssize_t read = regular ? ::pread(descriptor, header.data(), header.size(), 0) : 0;
  ::close(descriptor);
  if (known && S_ISDIR(status.st_mode)) return fault(path, "is a folder, not a map");
  if (!regular) return fault(path, "is no regular file");
  if (read < 0) return fault(path, "cannot be read");
  if (read == 0) return fault(path, "is empty, not a map");
  constexpr std::string_view kMagic("SQLite format 3\0", 16);
  const std::size_t seen = std::min(kMagic.size(), static_cast<std::size_t>(read));
  if (std::memcmp(header.data(), kMagic.data(), seen) != 0) return fault(path, "is not a map");
  if (static_cast<std::size_t>(read) < header.size()) return fault(path, "is cut short");
  if (big_endian(header, 68) != kApplicationId)
    return fault(path, "is a database of another program, not a map");
  const std::uint32_t page_field = (std::uint32_t{header[16]} << 8) | header[17];
  const std::uint64_t page_bytes = page_field == 1 ? 65536 : page_field;
  const std::uint64_t expected = page_bytes * big_endian(header, 28);
  const auto bytes = static_cast<std::uint64_t>(status.st_size);
  if (!has_log && bytes < expected)
    return fault(path, fmt::format("is cut short: {} bytes of {}", bytes, expected));
  return FileHeader{bytes, big_endian(header, 60)};
}

/// @return what the schema has that a map's has not, or the other way round; empty if nothing.
std::string schema_fault(Database& database) {
  auto rows = database.prepare("SELECT type, name, sql FROM sqlite_schema");
  if (!rows) return database.message();
  std::set<std::string> missing(table_statements().begin(), table_statements().end());
  while (rows->next()) {
    const auto type = rows->text(0);
    const auto name = rows->text(1);
    const auto sql = rows->text(2);
    if (!type || !name || !sql || missing.erase(std::string(*sql)) == 0)
      return fmt::format("has a {} '{}' that no map has", short_text(type.value_or("thing")),
                         short_text(name.value_or("")));
  }
  if (rows->failed()) return database.message();
  return missing.empty() ? "" : "a table is missing: " + *missing.begin();
}

/// Whoever reads must know what it cannot read, as far as that is possible.
std::string newer_text(Database& database, std::uint32_t format) {
  std::string version = "?";
  auto row = database.prepare("SELECT value FROM meta WHERE key = 'program_version'");
  if (row && row->next()) version = short_text(row->text(0).value_or("?"));
  return fmt::format("written by version {} in format {}; this version {} reads up to format {}",
                     version, format, program_version(), kFormat);
}

}  // namespace

const std::vector<std::string>& table_statements() {
  static const std::vector<std::string> statements = [] {
    std::vector<std::string> all = {
        "CREATE TABLE meta(key TEXT PRIMARY KEY NOT NULL, value TEXT NOT NULL) STRICT, WITHOUT "
        "ROWID",
        "CREATE TABLE keyframe(id INTEGER PRIMARY KEY, parent INTEGER NOT NULL, stamp_ns INTEGER "
        "NOT NULL, checksum INTEGER NOT NULL) STRICT"};
    for (std::size_t table = 1; table < kTables; ++table)
      all.push_back(fmt::format(
          "CREATE TABLE {}(id INTEGER PRIMARY KEY, data BLOB NOT NULL) STRICT", kTableNames[table]));
    return all;
  }();
  return statements;
}

bool has_map_header(const fs::path& path) {
  return read_header(path, true).ok();  // of any length
}

Result<MetaEntries> read_meta_entries(Database& database) {
  MetaEntries entries;
  auto rows = database.prepare("SELECT key, value FROM meta");
  while (rows && rows->next()) {
    const auto name = rows->text(0);
    const auto value = rows->text(1);
    if (!name || !value || entries.size() == kMostMetaEntries)
      return Error{ErrorKind::kSavedMap, "meta: entries that no map has"};
    entries.emplace_back(*name, *value);
  }
  if (!rows || rows->failed()) return Error{ErrorKind::kSavedMap, "meta: " + database.message()};
  return entries;
}

std::string structure_fault(Database& database) {
  auto rows = database.prepare("PRAGMA quick_check(1)");
  if (!rows || !rows->next()) return "damaged: " + database.message();
  const auto text = rows->text(0);
  return text && *text == "ok" ? "" : "damaged: " + short_text(text.value_or("structure"));
}

Result<OpenedMap> open_map(const fs::path& path, MetaFaults faults) {
  std::error_code none;
  fs::path log = path;
  log += "-wal";
  const auto log_bytes = fs::file_size(log, none);
  // Without a log nobody is writing, or nothing was written yet: SQLite need not share the file
  // and leaves nothing in its folder.
  const bool has_log = !none && log_bytes > 0;
  const auto header = read_header(path, has_log);
  if (!header) return header.error();
  auto database =
      Database::open(path, has_log ? Database::Access::kRead : Database::Access::kReadAlone);
  if (!database) return database.error();
  if (!database->run("PRAGMA cell_size_check=ON; PRAGMA mmap_size=0; PRAGMA query_only=ON; BEGIN"))
    return fault(path, database->message());
  if (header->format > kFormat) return fault(path, newer_text(*database, header->format));
  if (header->format != kFormat) return fault(path, "is a map that was never completed");
  if (const std::string schema = schema_fault(*database); !schema.empty())
    return fault(path, schema);
  const auto entries = read_meta_entries(*database);
  if (!entries) return fault(path, entries.error().message);
  auto meta = meta_of(*entries);
  if (!meta) return fault(path, meta.error().message);
  const std::uint64_t bytes = header->bytes + (has_log ? log_bytes : 0);
  if (faults == MetaFaults::kRefuse && !meta->fault.empty()) return fault(path, meta->fault);
  meta->info.bytes = bytes;
  return OpenedMap{std::move(*database), std::move(*meta), bytes};
}

}  // namespace ygslam::map_file
