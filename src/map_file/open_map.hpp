// Opens a map file of which nothing is known yet.
#pragma once

#include <filesystem>

#include "io/sqlite.hpp"
#include "map_file/map_meta.hpp"

namespace ygslam::map_file {

using sqlite::Database;
using sqlite::Statement;

inline constexpr std::uint32_t kApplicationId = 0x59474d50;  // "YGMP"
inline constexpr std::uint32_t kFormat = 2;                  // SQLite's user_version

/// The statements that make a map's tables; the schema of a map is these and nothing else.
[[nodiscard]] const std::vector<std::string>& table_statements();

/// Behind a fault of which recover_map() may save the rest.
inline constexpr const char* kRecoverHint = " (ygslam map recover may save the rest)";

struct OpenedMap {
  Database database;  ///< in a read transaction: nothing changes under the reader
  Meta meta;
  std::string cut;  ///< where it is shorter than it says: that; else empty
};
/// Of `meta`, and that the file was cut short: what can still be found is then there.
enum class MetaFaults { kRefuse, kKeep };
/// Looks at the kind of file, its header, its schema and its `meta`.
/// @return kSavedMap naming file and cause.
Result<OpenedMap> open_map(const std::filesystem::path& path,
                           MetaFaults faults = MetaFaults::kRefuse);

/// Whether the file starts as a map does.
[[nodiscard]] bool has_map_header(const std::filesystem::path& path);

/// SQLite's own check of the file's structure. @return what it found; empty if nothing.
[[nodiscard]] std::string structure_fault(Database& database);

/// The entries of `meta`, as they stand there.
Result<MetaEntries> read_meta_entries(Database& database);

}  // namespace ygslam::map_file
