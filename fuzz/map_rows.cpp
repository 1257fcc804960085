// A map file of rows that the bytes tell, each signed as a writer does it: what the checksums keep
// from the reader otherwise.
#include <fmt/format.h>

#include "core/check.hpp"
#include "fuzz/map_questions.hpp"
#include "fuzz/targets.hpp"
#include "io/testing/temp_folder.hpp"
#include "map/archive.hpp"
#include "map_file/open_map.hpp"
#include "map_file/row_blob.hpp"

namespace ygslam::fuzz {
namespace {

using map_file::RowKey;
using map_file::Table;

constexpr std::int64_t kMostPixels = 1 << 20;  // larger images cost time and show nothing new

/// The summary: what stands in `meta` apart from the digest. Nothing where the bytes are too few.
std::optional<map_file::Meta> read_meta(ArchiveReader& in) {
  map_file::Meta meta;
  MapFileInfo& info = meta.info;
  in.number(info.camera.width);
  in.number(info.camera.height);
  for (const map_file::CameraNumber& number : map_file::kCameraNumbers)
    in.number(info.camera.*number.value);
  in.number(info.pyramid_levels);
  in.number(info.pyramid_factor);
  for (auto* count :
       {&info.keyframes, &info.removed_keyframes, &info.landmarks, &info.observations})
    in.number(*count);
  in.number(meta.numbers.next_keyframe);
  in.number(meta.numbers.next_landmark);
  const bool small = std::int64_t{info.camera.width} * info.camera.height <= kMostPixels;
  return in.ok() && small ? std::optional(meta) : std::nullopt;
}

/// Writes the next row that the bytes tell: table, number, size, content.
/// @return its share of the digest; nothing at the end.
std::optional<std::uint64_t> write_row(std::string_view& bytes, map_file::Database& database) {
  struct Head {
    std::uint32_t id = 0;
    std::uint16_t size = 0;
    std::uint16_t table = 0;
  } head;
  if (bytes.size() < sizeof(head)) return std::nullopt;
  std::memcpy(&head, bytes.data(), sizeof(head));
  bytes.remove_prefix(sizeof(head));
  const RowKey key{static_cast<Table>(head.table % map_file::kTables), head.id};
  std::string content(bytes.substr(0, head.size));
  bytes.remove_prefix(content.size());
  static map_file::RowCodec codec;
  const std::uint64_t hash = map_file::hash_of(content);
  if (key.table == Table::kKeyframe) {
    std::array<std::int64_t, 2> numbers{};  // parent, time
    std::memcpy(numbers.data(), content.data(), std::min(content.size(), sizeof(numbers)));
    content.assign(reinterpret_cast<const char*>(numbers.data()), sizeof(numbers));
    auto row = database.prepare("INSERT OR IGNORE INTO keyframe VALUES (?, ?, ?, ?)");
    const auto checksum = map_file::checksum_of(key, content);
    CHECK(row &&
          row->bind(1, head.id).bind(2, numbers[0]).bind(3, numbers[1]).bind(4, checksum).run());
    return map_file::share_of(key, map_file::hash_of(content));
  }
  auto row = database.prepare(
      fmt::format("INSERT OR IGNORE INTO {} VALUES (?, ?)", map_file::name_of(key.table)));
  CHECK(row && row->bind(1, head.id).bind(2, codec.encode(key, content, hash)).run());
  return map_file::share_of(key, hash);
}

void write_file(const std::filesystem::path& path, map_file::Meta meta, std::string_view rows) {
  auto database = map_file::Database::open(path, map_file::Database::Access::kCreate);
  CHECK(database.ok());
  std::string sql =
      "PRAGMA page_size=512; PRAGMA journal_mode=MEMORY; PRAGMA synchronous=OFF; BEGIN;";
  for (const std::string& statement : map_file::table_statements()) sql += statement + ";";
  sql += fmt::format("PRAGMA application_id={}; PRAGMA user_version={};", map_file::kApplicationId,
                     map_file::kFormat);
  CHECK(database->run(sql.c_str()));
  while (const auto share = write_row(rows, *database)) meta.rows_digest += *share;
  auto entry = database->prepare("INSERT INTO meta VALUES (?, ?)");
  for (const auto& [name, value] : map_file::entries_of(meta))
    CHECK(entry->bind_text(1, name).bind_text(2, value).run());
  CHECK(database->run("COMMIT"));
}

}  // namespace

void map_rows(std::string_view bytes) {
  ArchiveReader in(bytes);
  const auto meta = read_meta(in);
  if (!meta) return;
  static const testing::TempFolder kFolder("ygslam-fuzz-map-rows");
  const auto path = kFolder.path() / "room.map";
  write_file(path, *meta, bytes.substr(bytes.size() - in.remaining()));
  ask_map_file(path);
  for (const auto& left : std::filesystem::directory_iterator(kFolder.path()))
    std::filesystem::remove(left);
}

}  // namespace ygslam::fuzz
