#include "map_file/open_map.hpp"

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

std::string short_text(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string plain;
  for (const char c : text.substr(0, kLongest)) plain += c >= ' ' && c <= '~' ? c : '?';
  return plain;
}

/// @return why the path can be no map; empty if it may be one.
std::string kind_fault(const fs::path& path) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) return code ? code.message() : std::strerror(ENOENT);
  if (fs::is_directory(status)) return "is a folder, not a map";
  return fs::is_regular_file(status) ? "" : "is no regular file";
}

/// What SQLite's header says: SQLite itself reports less of it.
struct FileHeader {
  std::uint32_t application = 0;
  std::uint32_t format = 0;
  std::uint64_t bytes = 0;  ///< that there should be
  std::string fault;
};
FileHeader read_header(const Database& database) {
  FileHeader header;
  std::array<unsigned char, kHeader_bytes> bytes{};
  const std::optional<std::size_t> read = database.read_start(bytes);
  constexpr std::string_view kMagic("SQLite format 3\0", 16);
  if (!read) {
    header.fault = "cannot be read";
  } else if (*read == 0) {
    header.fault = "is empty, not a map";
  } else if (std::memcmp(bytes.data(), kMagic.data(), std::min(kMagic.size(), *read)) != 0) {
    header.fault = "is not a map";
  } else if (*read < bytes.size()) {
    header.fault = "is cut short";
  }
  if (!header.fault.empty()) return header;
  const auto number = [&](std::size_t at, std::size_t size) {  // big endian
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value = (value << 8) | bytes[at + i];
    return value;
  };
  const std::uint32_t page_bytes = number(16, 2) == 1 ? 65536 : number(16, 2);
  header.bytes = std::uint64_t{page_bytes} * number(28, 4);
  header.format = number(60, 4);
  header.application = number(68, 4);
  if (header.application != kApplicationId)
    header.fault = "is a database of another program, not a map";
  return header;
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
std::string other_format_text(Database& database, std::uint32_t format) {
  std::string version = "?";
  auto row = database.prepare("SELECT value FROM meta WHERE key = 'program_version'");
  if (row && row->next()) version = short_text(row->text(0).value_or("?"));
  return fmt::format("written by version {} in format {}; this version {} reads format {}", version,
                     format, program_version(), kFormat);
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
      all.push_back(
          fmt::format("CREATE TABLE {}(id INTEGER PRIMARY KEY, data BLOB NOT NULL) STRICT",
                      kTableNames[table]));
    return all;
  }();
  return statements;
}

bool has_map_header(const fs::path& path) {
  const auto database = Database::open(path, Database::Access::kReadAlone);
  return database.ok() && read_header(*database).fault.empty();
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
  if (const std::string kind = kind_fault(path); !kind.empty()) return fault(path, kind);
  std::error_code none;
  fs::path log = path;
  log += "-wal";
  // Without a log nobody is writing: SQLite need not share the file and leaves nothing beside it.
  const bool has_log = fs::exists(log, none);
  const auto log_bytes = has_log ? fs::file_size(log, none) : 0;
  const auto file_bytes = fs::file_size(path, none);
  auto database =
      Database::open(path, has_log ? Database::Access::kRead : Database::Access::kReadAlone);
  if (!database) return database.error();
  const FileHeader header = read_header(*database);
  if (!header.fault.empty()) return fault(path, header.fault);
  std::string cut;
  if (log_bytes == 0 && file_bytes < header.bytes) {
    cut = fmt::format("is cut short: {} bytes of {}", file_bytes, header.bytes);
    if (faults == MetaFaults::kRefuse) return fault(path, cut + kRecoverHint);
    if (!database->read_cut_short()) return fault(path, cut);
  }
  if (!database->run("PRAGMA cell_size_check=ON; PRAGMA mmap_size=0; PRAGMA query_only=ON; BEGIN"))
    return fault(path, database->message());
  if (header.format == 0) return fault(path, "is a map that was never completed");
  if (header.format != kFormat) return fault(path, other_format_text(*database, header.format));
  if (const std::string schema = schema_fault(*database); !schema.empty()) {
    const bool log_is_shut = has_log && database->lacks_access();
    return fault(path, schema + (log_is_shut ? "; its log beside it needs a folder that can be "
                                               "written: copy both"
                                             : ""));
  }
  const auto entries = read_meta_entries(*database);
  if (!entries) return fault(path, entries.error().message);
  auto meta = meta_of(*entries);
  if (!meta) return fault(path, meta.error().message);
  if (faults == MetaFaults::kRefuse && !meta->fault.empty())
    return fault(path, meta->fault + kRecoverHint);
  meta->info.bytes = file_bytes + log_bytes;
  return OpenedMap{std::move(*database), std::move(*meta), std::move(cut)};
}

}  // namespace ygslam::map_file
