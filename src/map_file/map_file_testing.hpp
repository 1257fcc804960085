// For tests of map files: a map with everything in it, and ways to spoil its file.
#pragma once

#include <sqlite3.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "io/testing/temp_folder.hpp"
#include "map/map_bytes.hpp"
#include "map/map_test_world.hpp"
#include "map_file/map_file.hpp"
#include "map_file/open_map.hpp"
#include "map_file/row_blob.hpp"

namespace ygslam::map_file_test {

namespace fs = std::filesystem;

inline Camera camera() { return map_test::camera(); }
inline PyramidScales scales() { return {map_test::kLevels, map_test::kScale}; }

/// Grows keyframe by keyframe: features, free space, read-out, weights, landmarks, and every few
/// keyframes one that goes.
class GrowingMap {
 public:
  explicit GrowingMap(int points = 150, std::uint64_t seed = 5)
      : world_(points, seed), landmark_(static_cast<std::size_t>(points), kNoLandmark) {}

  void grow(int keyframes) {
    for (int i = 0; i < keyframes; ++i) grow();
  }
  [[nodiscard]] const Map& map() const { return map_; }

 private:
  void grow() {
    const auto id = map_.next_keyframe_id();
    const int i = static_cast<int>(index(id));
    const auto seen = world_.see(map_test::World::pose(i % 20), 10 * index(id), {0.5, 0.9, 6});
    auto data = std::make_shared<KeyframeData>();
    data->id = id;
    data->frame = seen.frame->id;
    data->stamp = seen.frame->stamp;
    data->features = seen.features;
    data->grid = seen.grid;
    DepthImage depth_m(80, 64);
    for (float& d : depth_m) d = static_cast<float>(world_.rng().uniform(1, 4));
    if (i % 2 == 1)  // in whole units, as a sensor has it
      for (float& d : depth_m) d = std::round(d * 5000) * static_cast<float>(1 / 5000.0);
    data->free_space = FreeSpaceImage(depth_m);
    data->read_out = {{0.03, 0.02, -0.01}, Vec6::Constant(0.1 * (i % 5))};
    std::vector<float> weight(seen.features->size(), 0.75F);
    const KeyframeId parent =
        map_.keyframes().empty() ? kNoKeyframe : map_.keyframes().rbegin()->first;
    map_.add_keyframe(std::move(data), seen.T_camera_world, parent, std::move(weight));
    for (std::uint32_t k = 0; k < seen.point.size(); ++k) {
      const auto point = static_cast<std::size_t>(seen.point[k]);
      LandmarkId& landmark = landmark_[point];
      if (landmark == kNoLandmark || !map_.has_landmark(landmark)) {
        landmark = map_.add_landmark(world_.points()[point].p_world, id, k);
      } else if (map_.add_observation(landmark, id, k)) {
        map_.refresh(landmark);
        map_.count_seen(landmark, 2, 1);
      }
    }
    if (i % 5 == 3) map_.remove_keyframe(KeyframeId{index(id) - 1});
  }

  map_test::World world_;
  std::vector<LandmarkId> landmark_;
  Map map_{scales()};
};

inline Map some_map(int keyframes = 7) {
  GrowingMap growing;
  growing.grow(keyframes);
  return growing.map();
}

/// Runs SQL on a file as anybody can; triggers a failure of the test where it cannot.
inline void sql(const fs::path& path, const std::string& statements) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
  sqlite3_exec(db, "PRAGMA synchronous=OFF", nullptr, nullptr, nullptr);
  char* message = nullptr;
  EXPECT_EQ(sqlite3_exec(db, statements.c_str(), nullptr, nullptr, &message), SQLITE_OK)
      << statements << ": " << (message == nullptr ? "" : message);
  sqlite3_free(message);
  sqlite3_close(db);
}

/// Writes one value into a row.
inline void put_blob(const fs::path& path, const std::string& statement,
                     std::span<const char> bytes) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  sqlite3_exec(db, "PRAGMA synchronous=OFF", nullptr, nullptr, nullptr);
  sqlite3_stmt* row = nullptr;
  ASSERT_EQ(sqlite3_prepare_v2(db, statement.c_str(), -1, &row, nullptr), SQLITE_OK) << statement;
  sqlite3_bind_blob64(row, 1, bytes.data(), bytes.size(), SQLITE_STATIC);
  EXPECT_EQ(sqlite3_step(row), SQLITE_DONE);
  sqlite3_finalize(row);
  sqlite3_close(db);
}

inline std::string get_blob(const fs::path& path, const std::string& statement) {
  sqlite3* db = nullptr;
  sqlite3_open(path.c_str(), &db);
  sqlite3_stmt* row = nullptr;
  sqlite3_prepare_v2(db, statement.c_str(), -1, &row, nullptr);
  std::string blob;
  if (sqlite3_step(row) == SQLITE_ROW)
    blob.assign(static_cast<const char*>(sqlite3_column_blob(row, 0)),
                static_cast<std::size_t>(sqlite3_column_bytes(row, 0)));
  sqlite3_finalize(row);
  sqlite3_close(db);
  return blob;
}

inline std::string where(const map_file::RowKey& key) {
  return fmt::format("{} WHERE id = {}", map_file::name_of(key.table), key.id);
}
inline std::string row_blob(const fs::path& path, const map_file::RowKey& key) {
  return get_blob(path, "SELECT data FROM " + where(key));
}
inline void set_row_blob(const fs::path& path, const map_file::RowKey& key,
                         std::span<const char> blob) {
  put_blob(
      path,
      fmt::format("UPDATE {} SET data = ? WHERE id = {}", map_file::name_of(key.table), key.id),
      blob);
}

/// Changes `meta` as a writer does who knows its checksums.
inline void sign_meta(const fs::path& path, const std::function<void(map_file::Meta&)>& change) {
  auto opened = map_file::open_map(path, map_file::MetaFaults::kKeep);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  map_file::Meta meta = opened->meta;
  opened->database.close();
  change(meta);
  std::string statements = "BEGIN;";
  for (const auto& [name, value] : map_file::entries_of(meta))
    statements += fmt::format("UPDATE meta SET value = '{}' WHERE key = '{}';", value, name);
  sql(path, statements + "COMMIT");
}

/// Changes a row's content and signs it again: checksums are right, the content need not be.
inline void sign_row(const fs::path& path, const map_file::RowKey& key,
                     const std::function<void(std::string&)>& change) {
  map_file::RowCodec codec;
  map_file::DecodeBudget budget;
  map_file::RowContent row;
  ASSERT_EQ(codec.decode(key, row_blob(path, key), budget, row), nullptr);
  change(row.raw);
  const std::uint64_t after = map_file::hash_of(row.raw);
  set_row_blob(path, key, codec.encode(key, row.raw, after));
  sign_meta(path, [&](map_file::Meta& meta) {
    meta.rows_digest += map_file::share_of(key, after) - map_file::share_of(key, row.hash);
  });
}

/// Sets a number at a place of the row's raw bytes.
template <typename T>
void sign_number(const fs::path& path, const map_file::RowKey& key, std::size_t at, T value) {
  sign_row(path, key, [&](std::string& raw) {
    ASSERT_LE(at + sizeof(T), raw.size());
    std::memcpy(raw.data() + at, &value, sizeof(T));
  });
}

/// The row of `keyframe` with its numbers and checksum.
inline void sign_keyframe(const fs::path& path, std::uint32_t id, std::int64_t parent_before,
                          std::int64_t parent, std::int64_t stamp_ns) {
  const map_file::RowKey key{map_file::Table::kKeyframe, id};
  const auto raw = [&](std::int64_t p) {
    std::string bytes(16, '\0');
    std::memcpy(bytes.data(), &p, 8);
    std::memcpy(bytes.data() + 8, &stamp_ns, 8);
    return bytes;
  };
  sql(path, fmt::format("UPDATE keyframe SET parent = {}, checksum = {} WHERE id = {}", parent,
                        map_file::checksum_of(key, raw(parent)), id));
  sign_meta(path, [&](map_file::Meta& meta) {
    meta.rows_digest += map_file::share_of(key, map_file::hash_of(raw(parent))) -
                        map_file::share_of(key, map_file::hash_of(raw(parent_before)));
  });
}

inline Result<Map> load(const fs::path& path) { return load_map(path, camera(), scales()); }

/// The file is refused with one line that names it and holds `cause`.
inline void expect_refused(const fs::path& path, const std::string& cause) {
  const auto map = load(path);
  ASSERT_FALSE(map.ok()) << "accepted, but: " << cause;
  EXPECT_EQ(map.error().kind, ErrorKind::kSavedMap);
  EXPECT_NE(map.error().message.find(path.filename().string()), std::string::npos)
      << map.error().message;
  EXPECT_NE(map.error().message.find(cause), std::string::npos) << map.error().message;
  EXPECT_EQ(map.error().message.find('\n'), std::string::npos) << map.error().message;
}

/// Root may write anywhere: be nobody while this lives.
class Nobody {
 public:
  Nobody() : before_(::geteuid()) {
    if (before_ == 0 && ::seteuid(65534) != 0) ADD_FAILURE() << "cannot be nobody";
  }
  Nobody(const Nobody&) = delete;
  Nobody& operator=(const Nobody&) = delete;
  ~Nobody() {
    if (::seteuid(before_) != 0) ADD_FAILURE() << "cannot be root again";
  }

 private:
  uid_t before_;
};

/// Files in a folder.
inline std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

}  // namespace ygslam::map_file_test
