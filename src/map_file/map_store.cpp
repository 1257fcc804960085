#include "map_file/map_store.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "map/descriptor_sources.hpp"
#include "map/map_fields.hpp"

namespace ygslam::map_file {
namespace fs = std::filesystem;
namespace {

// Pages are small because what remains of each row's last one stays empty (at 16 kB a tenth of the
// file), but each costs a few bytes, too: 1 kB and 4 kB make larger files than 2 kB.
// No journal on the disk. OFF is not to be had: SQLite's protection refuses it.
constexpr const char* kNewFile =
    "PRAGMA page_size=2048; PRAGMA journal_mode=MEMORY; PRAGMA synchronous=OFF;"
    "PRAGMA locking_mode=EXCLUSIVE;";
// FULL: what write() returned for survives a loss of power. A log that one large write made long
// is cut again.
constexpr const char* kRunning =
    "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA journal_size_limit=33554432;"
    "BEGIN IMMEDIATE; ROLLBACK;";  // whether it can be written is told at once

std::string put_statement(std::size_t table) {
  if (table == 0)
    return "INSERT OR REPLACE INTO keyframe(id, parent, stamp_ns, checksum) VALUES (?, ?, ?, ?)";
  return fmt::format("INSERT OR REPLACE INTO {}(id, data) VALUES (?, ?)", kTableNames[table]);
}

std::int64_t parent_value(KeyframeId parent) {
  return parent == kNoKeyframe ? -1 : std::int64_t{index(parent)};
}

}  // namespace

/// A transaction in the making.
struct MapStore::Change {
  std::array<Hashes, kTables> hashes;  // of all rows that the file has with it
  std::vector<Statement> put;
  std::uint64_t digest = 0;
  std::uint64_t observations = 0;
  ArchiveWriter raw;

  void keep(const RowKey& key, std::uint64_t hash) {
    hashes[static_cast<std::size_t>(key.table)][key.id] = hash;
    digest += share_of(key, hash);
  }
};

MapStore::MapStore(fs::path path, Database database, Meta meta)
    : path_(std::move(path)),
      database_(std::move(database)),
      meta_(std::move(meta)),
      camera_(meta_.info.camera) {}

Error MapStore::error(const std::string& what) const {
  return {ErrorKind::kOutput, path_.string() + ": " + what};
}

Result<MapStore> MapStore::create(const fs::path& path, MapFileInfo info) {
  auto database = Database::open(path, Database::Access::kCreate);
  if (!database) return database.error();
  Meta meta;
  meta.info = std::move(info);
  MapStore store(path, std::move(*database), std::move(meta));
  std::string sql = kNewFile;
  for (const std::string& statement : table_statements()) sql += statement + ";";
  sql += fmt::format("PRAGMA application_id={}; PRAGMA user_version={};", kApplicationId, kFormat);
  if (!store.database_.run(sql.c_str())) return store.error(store.database_.message());
  store.is_new_ = true;
  return store;
}

Result<MapStore> MapStore::go_on(const fs::path& path, Meta meta) {
  auto database = Database::open(path, Database::Access::kWrite);
  if (!database) return database.error();
  MapStore store(path, std::move(*database), std::move(meta));
  if (!store.database_.run(kRunning)) return store.error(store.database_.message());
  if (Status read = store.read_hashes(); !read) return read.error();
  return store;
}

/// What the rows hold that are there, by their headers alone.
Status MapStore::read_hashes() {
  std::uint64_t digest = 0;
  for (std::size_t table = 0; table < kTables; ++table) {
    auto rows = database_.prepare(table == 0 ? "SELECT id, parent, stamp_ns FROM keyframe"
                                             : fmt::format("SELECT id, substr(data, 1, {}) FROM {}",
                                                           kRowHeader_bytes, kTableNames[table]));
    while (rows && rows->next()) {
      const RowKey key{static_cast<Table>(table),
                       static_cast<std::uint32_t>(rows->integer(0).value_or(-1))};
      std::optional<std::uint64_t> hash;
      if (table == 0) {
        ArchiveWriter raw;
        raw.number(rows->integer(1).value_or(-1));
        raw.number(rows->integer(2).value_or(0));
        hash = hash_of(raw.bytes());
      } else if (const auto header = rows->bytes(1)) {
        hash = hash_in_header(key.table, *header);
      }
      if (!hash) return Error{ErrorKind::kSavedMap, path_.string() + ": damaged: see map check"};
      hashes_[table][key.id] = *hash;
      digest += share_of(key, *hash);
    }
    if (!rows || rows->failed()) return error(database_.message());
  }
  if (digest != meta_.rows_digest)
    return Error{ErrorKind::kSavedMap,
                 path_.string() + ": damaged: its rows do not belong together"};
  return Ok{};
}

Status MapStore::put(const RowKey& key, Change& change) {
  const std::string& raw = change.raw.bytes();
  const auto table = static_cast<std::size_t>(key.table);
  const std::uint64_t hash = hash_of(raw);
  change.keep(key, hash);
  const auto before = hashes_[table].find(key.id);
  if (before != hashes_[table].end() && before->second == hash) return Ok{};
  Statement& statement = change.put[table];
  statement.bind(1, key.id);
  if (key.table == Table::kKeyframe) {
    ArchiveReader in(raw);
    std::int64_t parent = 0;
    std::int64_t stamp_ns = 0;
    in.number(parent);
    in.number(stamp_ns);
    statement.bind(2, parent).bind(3, stamp_ns).bind(4, checksum_of(key, raw));
  } else {
    statement.bind(2, codec_.encode(key, raw, hash, change.raw.parts()));
  }
  return statement.run() ? Status(Ok{}) : error(database_.message());
}

Status MapStore::write_rows(const Map& map, Change& change) {
  ArchiveWriter& raw = change.raw;
  const auto write_each = [&](Table table, auto&& fields) -> Status {
    for (const auto& [id, keyframe] : map.keyframes()) {
      const RowKey key{table, index(id)};
      const auto written = seen_.find(key.id);
      if (table == Table::kSeen && written != seen_.end() &&
          written->second.lock() == keyframe.data) {
        change.keep(key, hashes_[static_cast<std::size_t>(table)].at(key.id));
        continue;
      }
      raw.clear();
      fields(keyframe);
      if (Status done = put(key, change); !done) return done;
    }
    return Ok{};
  };
  Status done = write_each(Table::kKeyframe, [&](const Keyframe& keyframe) {
    raw.number(parent_value(keyframe.parent));
    raw.number(keyframe.data->stamp.ns);
  });
  if (done)
    done = write_each(Table::kPose, [&](const Keyframe& keyframe) {
      map_fields::pose(raw, keyframe.T_camera_world);
    });
  if (done)
    done = write_each(Table::kSeen, [&](const Keyframe& keyframe) {
      map_fields::seen(raw, *keyframe.data, &camera_);
    });
  if (done)
    done = write_each(Table::kWeight, [&](const Keyframe& keyframe) {
      map_fields::static_weight(raw, keyframe.static_weight);
    });
  if (done) done = write_removed(map, change);
  if (done) done = write_landmarks(map, change);
  return done;
}

Status MapStore::write_removed(const Map& map, Change& change) {
  std::vector<RemovedKeyframe> chunk;
  const auto& all = map.removed_keyframes();
  for (auto it = all.begin(); it != all.end();) {
    const std::uint32_t number = index(it->id) / kChunk;
    chunk.clear();
    for (; it != all.end() && index(it->id) / kChunk == number; ++it) chunk.push_back(*it);
    change.raw.clear();
    change.raw.count(chunk);
    for (const RemovedKeyframe& removed : chunk) map_fields::removed_keyframe(change.raw, removed);
    if (Status done = put({Table::kRemoved, number}, change); !done) return done;
  }
  return Ok{};
}

Status MapStore::write_landmarks(const Map& map, Change& change) {
  std::vector<const Landmark*> all;
  all.reserve(map.landmark_count());
  map.for_each_landmark([&](const Landmark& landmark) { all.push_back(&landmark); });
  std::ranges::sort(all, {}, &Landmark::id);
  DescriptorSources sources(map);
  for (const Table table : {Table::kLandmarks, Table::kObservations}) {
    std::vector<const Landmark*> chunk;
    for (auto it = all.begin(); it != all.end();) {
      const std::uint32_t number = index((*it)->id) / kChunk;
      chunk.clear();
      for (; it != all.end() && index((*it)->id) / kChunk == number; ++it) chunk.push_back(*it);
      change.raw.clear();
      if (table == Table::kLandmarks) {
        map_fields::landmarks(change.raw, chunk, sources.of(chunk));
      } else {
        map_fields::observations(change.raw, chunk);
        for (const Landmark* landmark : chunk) change.observations += landmark->observations.size();
      }
      if (Status done = put({table, number}, change); !done) return done;
    }
  }
  return Ok{};
}

Status MapStore::delete_others(const Change& change) {
  for (std::size_t table = 0; table < kTables; ++table) {
    auto statement =
        database_.prepare(fmt::format("DELETE FROM {} WHERE id = ?", kTableNames[table]));
    if (!statement) return error(database_.message());
    for (const auto& [id, hash] : hashes_[table])
      if (!change.hashes[table].contains(id) && !statement->bind(1, id).run())
        return error(database_.message());
  }
  return Ok{};
}

Status MapStore::write_meta() {
  auto statement = database_.prepare("INSERT OR REPLACE INTO meta(key, value) VALUES (?, ?)");
  if (!statement) return error(database_.message());
  for (const auto& [name, value] : entries_of(meta_))
    if (!statement->bind_text(1, name).bind_text(2, value).run()) return error(database_.message());
  return Ok{};
}

Status MapStore::write(const Map& map) {
  CHECK(map.scales().levels() == meta_.info.pyramid_levels &&
            map.scales().factor() == meta_.info.pyramid_factor,
        "the file was opened for another image pyramid");
  Change change;
  for (std::size_t table = 0; table < kTables; ++table) {
    auto statement = database_.prepare(put_statement(table));
    if (!statement) return error(database_.message());
    change.put.push_back(std::move(*statement));
  }
  const Meta before = meta_;
  if (!database_.run("BEGIN IMMEDIATE")) return error(database_.message());
  Status done = write_rows(map, change);
  if (done) done = delete_others(change);
  if (done) {
    meta_.info.program_version = program_version();
    if (map.identity()) meta_.info.uuid = to_string(*map.identity());
    ++meta_.info.generation;
    meta_.info.keyframes = map.keyframes().size();
    meta_.info.removed_keyframes = map.removed_keyframes().size();
    meta_.info.landmarks = map.landmark_count();
    meta_.info.observations = change.observations;
    meta_.numbers = {index(map.next_keyframe_id()), index(map.next_landmark_id()), map.version()};
    meta_.rows_digest = change.digest;
    done = write_meta();
  }
  if (done && !database_.run("COMMIT")) done = error(database_.message());
  if (!done) {
    meta_ = before;
    change.put.clear();
    (void)database_.run("ROLLBACK");
    return done;
  }
  hashes_ = std::move(change.hashes);
  seen_.clear();
  for (const auto& [id, keyframe] : map.keyframes()) seen_[index(id)] = keyframe.data;
  return Ok{};
}

Status MapStore::close() {
  // Files lie on the disk ready for a log: turning that on later takes a journal, which a process
  // that is killed at that moment would leave behind.
  if (is_new_ && !database_.run("PRAGMA journal_mode=WAL")) return error(database_.message());
  // Fails without harm where somebody is reading: the log then stays beside the file.
  (void)database_.run("PRAGMA wal_checkpoint(TRUNCATE)");
  return database_.close() ? Status(Ok{}) : error(database_.message());
}

}  // namespace ygslam::map_file
