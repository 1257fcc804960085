// Files that are no maps, no more, or not quite: each is an error that names file and cause.
#include <fmt/format.h>
#include <sys/stat.h>

#include <set>

#include "map_file/map_file_testing.hpp"

namespace ygslam {
namespace {

using namespace map_file_test;  // NOLINT(google-build-using-namespace): its own helpers
using map_file::RowKey;
using map_file::Table;
using testing::TempFolder;

class MapDamage : public ::testing::Test {
 protected:
  MapDamage() : path_(folder_.path() / "room.map"), map_(some_map(9)) {
    EXPECT_TRUE(save_map(path_, map_, camera()).ok());
    whole_ = testing::read(path_);
  }
  void restore() { testing::write(path_, whole_); }
  /// What recover_map() saves of the file, or why it saves nothing.
  [[nodiscard]] Result<Map> recovered() const {
    const fs::path saved = folder_.path() / "saved.map";
    fs::remove(saved);
    const auto recovery = recover_map(path_, saved);
    if (!recovery.ok()) return recovery.error();
    auto back = load(saved);
    EXPECT_TRUE(back.ok()) << back.error().message;
    if (back.ok()) {
      EXPECT_EQ(back->keyframes().size(), recovery->keyframes);
    }
    return back;
  }

  TempFolder folder_;
  fs::path path_;
  Map map_;
  std::string whole_;
};

TEST_F(MapDamage, OtherThingsAreNoMaps) {
  const fs::path other = folder_.path() / "other";
  expect_refused(other, "No such file");
  fs::create_directory(other);
  expect_refused(other, "is a folder");
  fs::remove(other);
  ASSERT_EQ(::mkfifo(other.c_str(), 0600), 0);
  expect_refused(other, "is no regular file");
  fs::remove(other);
  fs::create_symlink("/dev/zero", other);
  expect_refused(other, "is no regular file");
  fs::remove(other);
  testing::write(other, "");
  expect_refused(other, "is empty");
  testing::write(other, "ply\nformat binary_little_endian 1.0\n");
  expect_refused(other, "is not a map");
  testing::write(other, std::string(100'000, '\0'));
  expect_refused(other, "is not a map");
  testing::write(other, whole_.substr(0, 60));
  expect_refused(other, "is cut short");
  fs::remove(other);
  sql(other, "CREATE TABLE shopping(item TEXT); INSERT INTO shopping VALUES ('milk')");
  expect_refused(other, "database of another program");
  sql(other, "PRAGMA application_id=1497845072");
  expect_refused(other, "never completed");
  sql(other, "PRAGMA user_version=2");
  expect_refused(other, "a table 'shopping' that no map has");
}

TEST_F(MapDamage, EveryTruncationIsSeen) {
  for (int percent = 0; percent < 100; ++percent) {
    testing::write(path_, whole_.substr(0, whole_.size() * percent / 100));
    const auto map = load(path_);
    ASSERT_FALSE(map.ok()) << percent;
    EXPECT_EQ(map.error().kind, ErrorKind::kSavedMap);
    (void)check_map(path_);  // an error or faults, no crash
    (void)recovered();
  }
  testing::write(path_, whole_.substr(0, whole_.size() - 1));
  expect_refused(path_, "is cut short: " + std::to_string(whole_.size() - 1) + " bytes of");
}

TEST_F(MapDamage, OfAFileThatWasCutShortTheRestIsSaved) {
  const auto saved_of = [&](int percent) -> std::size_t {
    testing::write(path_, whole_.substr(0, whole_.size() * percent / 100));
    const auto rest = recovered();
    if (!rest.ok()) return 0;
    EXPECT_NE(check_map(path_)->faults.front().find("is cut short"), std::string::npos);
    for (const auto& [id, keyframe] : rest->keyframes())
      EXPECT_EQ(keyframe.data->stamp.ns, map_.keyframe(id).data->stamp.ns);
    return rest->keyframes().size();
  };
  std::size_t most = 0;
  for (int percent = 5; percent < 100; percent += 5) {
    const std::size_t saved = saved_of(percent);
    EXPECT_GE(saved, most) << "of more of the file at " << percent << " %";
    most = saved;
  }
  EXPECT_GE(most, map_.keyframes().size() / 2);
  testing::write(path_, whole_.substr(0, whole_.size() * 95 / 100));
  expect_refused(path_, "is cut short");
}

TEST_F(MapDamage, WhereNothingIsLeftNothingIsSaved) {
  const fs::path saved = folder_.path() / "saved.map";
  for (int percent = 0; percent < 100; percent += 5) {
    testing::write(path_, whole_.substr(0, whole_.size() * percent / 100));
    const auto recovery = recover_map(path_, saved);
    EXPECT_EQ(fs::exists(saved), recovery.ok()) << percent;
    if (recovery.ok()) {
      EXPECT_GT(recovery->keyframes, 0U) << percent;
    }
    fs::remove(saved);
  }
}

TEST_F(MapDamage, OfAnotherFormat) {
  sign_meta(path_, [](map_file::Meta& meta) { meta.info.program_version = "9.1.0"; });
  sql(path_,
      "UPDATE meta SET value = '9.1.0' WHERE key = 'program_version';"
      "PRAGMA user_version=3");
  expect_refused(path_, "written by version 9.1.0 in format 3; this version 0.1.0 reads format 2");
  // Of version 0.1.0, when the first format was the newest.
  expect_refused("fuzz/corpus/map_file/first_format",
                 "written by version 0.1.0 in format 1; this version 0.1.0 reads format 2");
}

/// One bit of a row's blob, or of its checksum where it has no blob.
TEST_F(MapDamage, AFlippedBitIsNamedAndTheRestSaved) {
  Rng rng(3);
  const std::set<std::uint32_t> kept = [&] {
    std::set<std::uint32_t> ids;
    for (const auto& [id, keyframe] : map_.keyframes()) ids.insert(index(id));
    return ids;
  }();
  const std::uint32_t middle = *std::next(kept.begin(), 3);
  for (std::size_t table = 0; table < map_file::kTables; ++table) {
    for (int trial = 0; trial < 20; ++trial) {
      restore();
      const bool chunked = table >= static_cast<std::size_t>(Table::kLandmarks);
      const RowKey key{static_cast<Table>(table), chunked ? 0 : middle};
      if (key.table == Table::kKeyframe) {
        sql(path_,
            "UPDATE keyframe SET stamp_ns = stamp_ns + 1 WHERE id = " + std::to_string(middle));
      } else {
        std::string blob = row_blob(path_, key);
        ASSERT_GT(blob.size(), map_file::kRowHeader_bytes);
        blob[rng.below(static_cast<std::uint32_t>(blob.size()))] ^=
            static_cast<char>(1 << rng.below(8));
        set_row_blob(path_, key, blob);
      }
      const std::string name =
          std::string(map_file::name_of(key.table)) + " " + std::to_string(key.id);
      expect_refused(path_, name + ": ");
      const auto check = check_map(path_);
      ASSERT_TRUE(check.ok()) << check.error().message;
      ASSERT_FALSE(check->faults.empty());
      EXPECT_EQ(check->faults.front().find(name), 0U) << check->faults.front();

      const auto back = recovered();
      ASSERT_TRUE(back.ok()) << back.error().message;
      switch (key.table) {
        case Table::kLandmarks:
        case Table::kObservations:  // all landmarks are in one chunk
          EXPECT_EQ(back->landmark_count(), 0U);
          EXPECT_EQ(back->keyframes().size(), kept.size());
          break;
        case Table::kRemoved:
          EXPECT_EQ(back->landmark_count(), map_.landmark_count());
          EXPECT_TRUE(back->removed_keyframes().empty());
          break;
        default:
          EXPECT_EQ(back->keyframes().size(), kept.size() - 1);
          EXPECT_FALSE(back->has_keyframe(KeyframeId{middle}));
          EXPECT_GT(back->landmark_count(), map_.landmark_count() / 2);
          for (const auto& [id, keyframe] : back->keyframes())
            EXPECT_TRUE(keyframe.parent == kNoKeyframe || back->has_keyframe(keyframe.parent));
      }
      if (key.table == Table::kSeen || key.table == Table::kWeight) {  // its pose is known
        EXPECT_LT((back->resolved_pose(KeyframeId{middle}).t() -
                   map_.resolved_pose(KeyframeId{middle}).t())
                      .norm(),
                  1e-9);
      }
    }
  }
}

TEST_F(MapDamage, AChildOfARemovedKeyframeMayBeLost) {
  const KeyframeId removed = map_.removed_keyframes().front().id;
  const auto child = map_.keyframes().upper_bound(removed);
  const std::uint32_t id = index(child->first);
  sign_keyframe(path_, id, index(child->second.parent), index(removed),
                child->second.data->stamp.ns);
  ASSERT_TRUE(load(path_).ok());
  sql(path_, "DELETE FROM seen WHERE id = " + std::to_string(id));
  const auto back = recovered();
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->keyframes().size(), map_.keyframes().size() - 1);
  EXPECT_LT((back->resolved_pose(child->first).t() - child->second.T_camera_world.t()).norm(),
            1e-9);
}

TEST_F(MapDamage, ADamagedSummaryIsMadeAnew) {
  for (const std::string& value : {std::string("landmarks"), std::string("next_keyframe"),
                                   std::string("rows_digest"), std::string("uuid")}) {
    restore();
    sql(path_, "UPDATE meta SET value = value || '1' WHERE key = '" + value + "'");
    expect_refused(path_, "meta: ");
    const auto back = recovered();
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->keyframes().size(), map_.keyframes().size());
    EXPECT_EQ(back->landmark_count(), map_.landmark_count());
    EXPECT_EQ(back->next_keyframe_id(), map_.next_keyframe_id());
  }
  restore();
  sql(path_, "UPDATE meta SET value = '625' WHERE key = 'camera.fx'");
  expect_refused(path_, "meta: camera");
  EXPECT_FALSE(recover_map(path_, folder_.path() / "other.map").ok())
      << "a map whose camera is not certain is worth nothing";
}

TEST_F(MapDamage, NothingIsRecoveredOverAFile) {
  const auto recovery = recover_map(path_, path_);
  ASSERT_FALSE(recovery.ok());
  EXPECT_EQ(recovery.error().kind, ErrorKind::kUsage);
  EXPECT_EQ(testing::read(path_), whole_);
}

/// Rows that are good by themselves but not of one commit.
TEST_F(MapDamage, HalfAMapDoesNotLookWhole) {
  const std::uint32_t last = index(map_.keyframes().rbegin()->first);
  for (const char* table : {"keyframe", "pose", "seen", "weight"}) {
    restore();
    sql(path_, fmt::format("DELETE FROM {} WHERE id = {}", table, last));
    expect_refused(path_, fmt::format("{} {}: is missing", table, last));
  }
  restore();
  sql(path_, "DELETE FROM landmarks; DELETE FROM observations");
  expect_refused(path_, "0 landmarks of");
  restore();
  sql(path_, "DELETE FROM removed");
  expect_refused(path_, "0 removed keyframes of");
  restore();
  const Map older = [&] {
    Map map = map_;
    map.set_pose(KeyframeId{0},
                 SE3::exp(Vec6::Constant(0.1)) * map.keyframe(KeyframeId{0}).T_camera_world);
    return map;
  }();
  const fs::path other = folder_.path() / "older.map";
  ASSERT_TRUE(save_map(other, older, camera()).ok());
  set_row_blob(path_, {Table::kPose, 0}, row_blob(other, {Table::kPose, 0}));
  expect_refused(path_, "do not belong together");
  restore();  // a row in another's place
  set_row_blob(path_, {Table::kPose, last}, row_blob(path_, {Table::kPose, 0}));
  expect_refused(path_, fmt::format("pose {}: damaged: the checksum", last));
}

TEST_F(MapDamage, SqlMutantsAreRefused) {
  const std::string id = std::to_string(index(map_.keyframes().rbegin()->first));
  struct Mutant {
    std::string statements, cause;
  };
  const std::vector<Mutant> mutants = {
      {"CREATE TRIGGER t AFTER INSERT ON pose BEGIN DELETE FROM seen; END", "trigger 't'"},
      {"CREATE VIEW v AS SELECT * FROM pose", "view 'v'"},
      {"CREATE INDEX i ON keyframe(parent)", "index 'i'"},
      {"CREATE TABLE more(x)", "table 'more'"},
      {"CREATE VIRTUAL TABLE words USING fts5(text)", "that no map has"},
      {"DROP TABLE pose", "missing"},
      {"DROP TABLE pose; CREATE TABLE pose(id INTEGER PRIMARY KEY, data)", "table 'pose'"},
      {"DROP TABLE pose; CREATE VIEW pose AS SELECT id, zeroblob(9) AS data FROM seen", "'pose'"},
      {"DROP TABLE meta; CREATE VIRTUAL TABLE meta USING rtree(id, a, b)", "'meta'"},
      {"ALTER TABLE seen ADD COLUMN more INTEGER", "table 'seen'"},
      {"DELETE FROM meta WHERE key = 'generation'", "meta: "},
      {"INSERT INTO meta VALUES ('extra', '1')", "meta: "},
      {"UPDATE meta SET value = 'nan' WHERE key = 'camera.fx'", "meta: camera"},
      {"UPDATE meta SET value = '' WHERE key = 'pyramid.levels'", "meta: pyramid"},
      {"UPDATE pose SET id = -1 WHERE id = " + id, "pose -1: no number of a row"},
      {"UPDATE seen SET id = 9223372036854775807 WHERE id = " + id, "no number of a row"},
      {"UPDATE seen SET id = 4294967295 WHERE id = " + id, "no number of a row"},
      {"UPDATE keyframe SET id = id + 1000 WHERE id = " + id, "is missing"},
      {"UPDATE keyframe SET parent = 4294967294 WHERE id = " + id, "checksum"},
      {"UPDATE pose SET data = zeroblob(0) WHERE id = " + id, "cut short"},
      {"UPDATE pose SET data = zeroblob(60000000) WHERE id = " + id, "no row of this table"},
      {"UPDATE pose SET data = (SELECT data FROM weight LIMIT 1) WHERE id = " + id,
       "no row of this table"},
      // What STRICT tables and NOT NULL forbid, by the back door.
      {"PRAGMA writable_schema=ON; UPDATE sqlite_schema SET sql = 'CREATE TABLE pose(id INTEGER "
       "PRIMARY KEY, data)' WHERE name = 'pose'",
       "table 'pose'"},
      {"PRAGMA writable_schema=ON; DELETE FROM sqlite_schema WHERE name = 'weight'", "missing"},
      {"PRAGMA writable_schema=ON; UPDATE sqlite_schema SET rootpage = 2 WHERE name = 'pose'", ""},
      {"PRAGMA writable_schema=ON; UPDATE sqlite_schema SET sql = 'nonsense' WHERE name = 'pose'",
       ""},
  };
  for (const Mutant& mutant : mutants) {
    restore();
    sql(path_, mutant.statements);
    SCOPED_TRACE(mutant.statements);
    expect_refused(path_, mutant.cause);
    (void)check_map(path_);
    (void)recover_map(path_, folder_.path() / "rest.map");
    fs::remove(folder_.path() / "rest.map");
  }
}

/// Values that STRICT forbids are written while the table is not strict.
TEST_F(MapDamage, ValuesOfOtherTypesAreRefused) {
  const auto by_the_back_door = [&](const std::string& table, const std::string& loose,
                                    const std::string& statements) {
    restore();
    const std::string strict =
        get_blob(path_, "SELECT CAST(sql AS BLOB) FROM sqlite_schema WHERE name = '" + table + "'");
    const std::string set = "PRAGMA writable_schema=ON; UPDATE sqlite_schema SET sql = '";
    sql(path_, set + loose + "' WHERE name = '" + table + "'");
    sql(path_, statements);
    sql(path_, set + strict + "' WHERE name = '" + table + "'");
  };
  const std::string loose = "CREATE TABLE pose(id INTEGER PRIMARY KEY, data)";
  for (const std::string value : {"NULL", "7", "1e300", "''text''"}) {
    SCOPED_TRACE(value);
    std::string plain = value == "''text''" ? "'text'" : value;
    by_the_back_door("pose", loose, "UPDATE pose SET data = " + plain + " WHERE id = 0");
    expect_refused(path_, "");
  }
  by_the_back_door("keyframe",
                   "CREATE TABLE keyframe(id INTEGER PRIMARY KEY, parent, stamp_ns, "
                   "checksum)",
                   "UPDATE keyframe SET parent = 'nobody'");
  expect_refused(path_, "");
  by_the_back_door("keyframe",
                   "CREATE TABLE keyframe(id INTEGER PRIMARY KEY, parent, stamp_ns, "
                   "checksum)",
                   "UPDATE keyframe SET stamp_ns = NULL");
  expect_refused(path_, "");
}

TEST_F(MapDamage, ABombIsRefusedBeforeMemoryIsAskedFor) {
  // Ten gigabytes are announced; 60 MB of zeros again and again add up.
  const RowKey key{Table::kSeen, 0};
  std::string blob = row_blob(path_, key);
  const std::uint32_t huge = 0xffffffffU;
  std::memcpy(blob.data() + 8, &huge, sizeof(huge));
  set_row_blob(path_, key, blob);
  expect_refused(path_, "seen 0: damaged: the checksum");

  map_file::RowCodec codec;
  const std::string zeros(60 << 20, '\0');
  blob = std::string(codec.encode(key, zeros, map_file::hash_of(zeros)).data(),
                     codec.encode(key, zeros, map_file::hash_of(zeros)).size());
  ASSERT_LT(blob.size(), 10'000U);
  map_file::DecodeBudget budget{100 << 20};
  map_file::RowContent row;
  EXPECT_EQ(codec.decode(key, blob, budget, row), nullptr);
  EXPECT_EQ(row.raw.size(), zeros.size());
  map_file::RowContent nothing;
  EXPECT_NE(codec.decode(key, blob, budget, nothing), nullptr);
  EXPECT_LT(nothing.raw.capacity(), 1000U);

  restore();
  set_row_blob(path_, key, blob);
  expect_refused(path_, "seen 0: ");  // zeros are no features and a free-space image, and more
}

}  // namespace
}  // namespace ygslam
