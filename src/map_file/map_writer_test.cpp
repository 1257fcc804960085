// The file of a map that grows: what has been written is there, whatever happens next.
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "io/testing/file_size_limit.hpp"
#include "map_file/map_file_testing.hpp"

namespace ygslam {
namespace {

using namespace map_file_test;  // NOLINT(google-build-using-namespace): its own helpers
using map_file::RowKey;
using map_file::Table;
using testing::TempFolder;

MapWriter open_writer(const fs::path& path) {
  auto writer = MapWriter::open(path, camera(), scales());
  CHECK(writer.ok(), writer.error().message.c_str());
  return std::move(*writer);
}

TEST(MapWriter, EveryCommitIsTheMapAsItWas) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  GrowingMap growing;
  MapWriter writer = open_writer(path);
  EXPECT_EQ(load(path)->keyframes().size(), 0U) << "a map from the first moment on";
  for (int i = 0; i < 12; ++i) {
    growing.grow(1);
    const Status written = writer.write(growing.map());
    ASSERT_TRUE(written.ok()) << written.error().message;
    const auto back = load(path);  // while the writer holds it
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(to_bytes(*back), to_bytes(growing.map()));
  }
  EXPECT_EQ(read_map_info(path)->generation, 13U);
  ASSERT_TRUE(writer.close().ok());
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"room.map"});
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(growing.map()));
}

TEST(MapWriter, WritesWhatHasChangedOnly) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const Map map = some_map(12);
  MapWriter writer = open_writer(path);
  ASSERT_TRUE(writer.write(map).ok());
  const fs::path log = path.string() + "-wal";
  const auto log_bytes_of = [&](const Map& next) {
    // Frames of the log are used again after a checkpoint; all are counted from a fresh one.
    sql(path, "PRAGMA wal_checkpoint(TRUNCATE)");
    EXPECT_TRUE(writer.write(next).ok());
    return fs::file_size(log);
  };
  Map moved = map;
  moved.set_pose(KeyframeId{0},
                 SE3::exp(Vec6::Constant(0.1)) * map.keyframe(KeyframeId{0}).T_camera_world);
  EXPECT_LT(log_bytes_of(moved), 4U * 16384) << "one row and the summary";
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(moved));
}

TEST(MapWriter, GoesOnInAFile) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  GrowingMap growing;
  growing.grow(5);
  ASSERT_TRUE(save_map(path, growing.map(), camera()).ok());
  const std::string uuid = read_map_info(path)->uuid;
  {
    MapWriter writer = open_writer(path);
    EXPECT_EQ(to_bytes(*load(path)), to_bytes(growing.map())) << "until the first write";
    growing.grow(3);
    ASSERT_TRUE(writer.write(growing.map()).ok());
  }  // without close
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(growing.map()));
  EXPECT_EQ(read_map_info(path)->uuid, uuid);
  EXPECT_EQ(load(path)->identity(), growing.map().identity());

  // Another world with the same numbers in it.
  GrowingMap other(150, 99);
  other.grow(6);
  MapWriter writer = open_writer(path);
  ASSERT_TRUE(writer.write(other.map()).ok());
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(other.map()));
  EXPECT_EQ(load(path)->identity(), other.map().identity());
  EXPECT_NE(read_map_info(path)->uuid, uuid) << "another map in the same file";
  GrowingMap third(150, 100);  // and one in the middle of a run
  third.grow(6);
  ASSERT_TRUE(writer.write(third.map()).ok());
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(third.map()));
}

TEST(MapWriter, ASecondOneIsRefused) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  MapWriter first = open_writer(path);
  const auto second = MapWriter::open(path, camera(), scales());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().kind, ErrorKind::kOutput);
  EXPECT_NE(second.error().message.find("process " + std::to_string(::getpid())), std::string::npos)
      << second.error().message;
  EXPECT_EQ(save_map(path, some_map(1), camera()).error().kind, ErrorKind::kOutput);
  EXPECT_TRUE(load(path).ok()) << "whoever reads is not kept off";
  ASSERT_TRUE(first.close().ok());
  EXPECT_TRUE(MapWriter::open(path, camera(), scales()).ok());
}

TEST(MapWriter, RefusesWhatIsNoMapOfThisCamera) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  testing::write(path, "a letter");
  EXPECT_EQ(MapWriter::open(path, camera(), scales()).error().kind, ErrorKind::kSavedMap);
  EXPECT_EQ(testing::read(path), "a letter");
  fs::remove(path);
  ASSERT_TRUE(save_map(path, some_map(3), camera()).ok());
  CameraConfig other = camera().config();
  other.cx = 300;
  EXPECT_EQ(MapWriter::open(path, Camera(other), scales()).error().kind, ErrorKind::kSavedMap);
  sql(path, "DELETE FROM weight WHERE id = 0");
  EXPECT_EQ(MapWriter::open(path, camera(), scales()).error().kind, ErrorKind::kSavedMap);
  EXPECT_EQ(MapWriter::open(folder.path() / "none" / "a.map", camera(), scales()).error().kind,
            ErrorKind::kOutput);
}

TEST(MapWriter, AFileThatCannotBeWrittenIsRefusedAtOnce) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  ASSERT_TRUE(save_map(path, some_map(1), camera()).ok());
  fs::permissions(path, fs::perms(0444));
  fs::permissions(folder.path(), fs::perms(0777));
  const Nobody nobody;
  const auto writer = MapWriter::open(path, camera(), scales());
  ASSERT_FALSE(writer.ok());
  EXPECT_EQ(writer.error().kind, ErrorKind::kOutput);
  EXPECT_EQ(writer.error().message, path.string() + ": Permission denied");
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"room.map"});
}

TEST(MapWriter, GoesOnAfterAFullDisk) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  GrowingMap growing;
  growing.grow(3);
  MapWriter writer = open_writer(path);
  ASSERT_TRUE(writer.write(growing.map()).ok());
  const std::string before = to_bytes(growing.map());
  growing.grow(4);
  {
    const testing::FileSizeLimit full(fs::file_size(path) + 1000);
    const Status written = writer.write(growing.map());
    ASSERT_FALSE(written.ok());
    EXPECT_EQ(written.error().kind, ErrorKind::kOutput);
    EXPECT_NE(written.error().message.find("room.map: "), std::string::npos);
    const auto back = load(path);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(to_bytes(*back), before);
  }
  growing.grow(1);
  const Status again = writer.write(growing.map());
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(growing.map()));
  EXPECT_TRUE(writer.close().ok());
}

/// A file as a killed writer leaves it: main file, log, shared memory.
struct LeftBehind {
  std::string file, log;
  std::string checkpointed;  // the file with the log's pages in it
  Map before{scales()}, last{scales()};
};
LeftBehind left_behind() {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  LeftBehind left;
  GrowingMap growing;
  MapWriter writer = open_writer(path);
  growing.grow(4);
  EXPECT_TRUE(writer.write(growing.map()).ok());
  sql(path, "PRAGMA wal_checkpoint(TRUNCATE)");
  left.before = growing.map();
  growing.grow(2);
  EXPECT_TRUE(writer.write(growing.map()).ok());
  left.last = growing.map();
  left.file = testing::read(path);
  left.log = testing::read(path.string() + "-wal");
  sql(path, "PRAGMA wal_checkpoint(TRUNCATE)");
  left.checkpointed = testing::read(path);
  return left;
}

TEST(MapWriter, LogsThatDoNotBelong) {
  const LeftBehind left = left_behind();
  ASSERT_GT(left.log.size(), 10'000U);
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const fs::path log = path.string() + "-wal";
  testing::write(path, left.file);
  testing::write(log, left.log);
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(left.last));
  fs::remove(log);
  fs::remove(path.string() + "-shm");
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(left.before)) << "as it was at the last checkpoint";
  // Torn at a sector: the commit before holds.
  for (std::size_t bytes = 0; bytes < left.log.size(); bytes += 512 * 5) {
    testing::write(path, left.file);
    testing::write(log, left.log.substr(0, bytes));
    const auto back = load(path);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(to_bytes(*back), to_bytes(left.before)) << bytes;
    fs::remove(path.string() + "-shm");
  }
  // Of another map: the pages may fit, the rows do not.
  const Map other = some_map(9);
  fs::remove(log);
  ASSERT_TRUE(save_map(path, other, camera()).ok());
  testing::write(log, left.log);
  const auto foreign = load(path);
  if (foreign.ok()) {
    EXPECT_EQ(to_bytes(*foreign), to_bytes(other));
  } else {
    EXPECT_EQ(foreign.error().kind, ErrorKind::kSavedMap);
  }
  // A journal of something else must not be played back into a map.
  fs::remove(log);
  fs::remove(path.string() + "-shm");
  testing::write(path, left.file);
  testing::write(path.string() + "-journal", std::string(2000, 'j'));
  EXPECT_TRUE(load(path).ok());
  EXPECT_FALSE(MapWriter::open(path, camera(), scales()).ok());
  EXPECT_TRUE(load(path).ok());
}

TEST(MapWriter, PowerLostWhileTheLogIsTakenIn) {
  constexpr std::size_t kSector_bytes = 512;
  const LeftBehind left = left_behind();
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const fs::path log = path.string() + "-wal";
  Rng rng(23);
  int refused = 0;
  for (int trial = 0; trial < 40; ++trial) {
    // Some sectors have reached the disk, some have not.
    std::string torn = left.file;
    torn.resize(std::max(torn.size(), left.checkpointed.size()), '\0');
    for (std::size_t at = 0; at < left.checkpointed.size(); at += kSector_bytes)
      if (rng.below(2) == 0) torn.replace(at, kSector_bytes, left.checkpointed, at, kSector_bytes);
    testing::write(path, torn);
    testing::write(log, left.log);
    fs::remove(path.string() + "-shm");
    const auto map = load(path);
    ASSERT_TRUE(map.ok()) << map.error().message;
    EXPECT_EQ(to_bytes(*map), to_bytes(left.last)) << "the log is whole";
    fs::remove(log);
    fs::remove(path.string() + "-shm");
    const auto without = load(path);
    ASSERT_FALSE(without.ok() && to_bytes(*without) != to_bytes(left.before) &&
                 to_bytes(*without) != to_bytes(left.last));
    refused += without.ok() ? 0 : 1;
  }
  EXPECT_GT(refused, 30) << "half of the sectors are no map";
}

TEST(MapWriter, WhatAKilledWriterLeftInAReadOnlyFolder) {
  const LeftBehind left = left_behind();
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  testing::write(path, left.file);
  testing::write(path.string() + "-wal", left.log);
  fs::permissions(folder.path(), fs::perms(0555));
  {
    const Nobody nobody;
    const auto map = load(path);
    ASSERT_FALSE(map.ok()) << "the log cannot be taken in, and without it the map is another";
    EXPECT_EQ(map.error().kind, ErrorKind::kSavedMap);
    EXPECT_NE(map.error().message.find("copy both"), std::string::npos) << map.error().message;
  }
  fs::permissions(folder.path(), fs::perms(0755));
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(left.last));
}

TEST(MapWriter, SavingOverWhatAKilledWriterLeft) {
  const LeftBehind left = left_behind();
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  testing::write(path, left.file);
  testing::write(path.string() + "-wal", left.log);
  {
    const testing::FileSizeLimit full(1000);
    ASSERT_FALSE(save_map(path, some_map(2), camera()).ok());
  }
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(left.last));
  const Map map = some_map(2);
  ASSERT_TRUE(save_map(path, map, camera()).ok());
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(map));
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"room.map"});
}

/// Grows and writes until it is killed; says each commit into `said` after it.
[[noreturn]] void write_for_ever(const fs::path& path, const fs::path& said) {
  GrowingMap growing(60);
  MapWriter writer = open_writer(path);
  std::ofstream commits(said);
  for (int i = 1;; ++i) {
    growing.grow(1);
    if (!writer.write(growing.map()).ok()) ::_exit(1);
    commits << i << std::endl;
    if (i % 7 == 0) {  // closing and opening are instants, too
      if (!writer.close().ok()) ::_exit(1);
      writer = open_writer(path);
    }
    if (i == 200) ::_exit(2);
  }
}

/// @return commits that were lost, -1 for a fault.
void kill_at(int delay_us) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const fs::path said = folder.path() / "said";
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) write_for_ever(path, said);
  ::usleep(static_cast<useconds_t>(delay_us));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  int commits = 0;
  std::ifstream lines(said);
  for (int i = 0; lines >> i;) commits = i;
  if (!fs::exists(path)) {
    EXPECT_EQ(commits, 0) << "before the file was there";
    return;
  }
  const auto check = check_map(path);
  ASSERT_TRUE(check.ok()) << check.error().message;
  EXPECT_TRUE(check->faults.empty()) << check->faults.front();
  const auto back = load(path);
  ASSERT_TRUE(back.ok()) << delay_us << ": " << back.error().message;
  const int there = static_cast<int>(check->info.generation) - 1;
  EXPECT_GE(there, commits) << "what was written must be there";
  EXPECT_LE(there, commits + 1);
  GrowingMap expected(60);
  expected.grow(there);
  EXPECT_EQ(to_bytes(*back), to_bytes(expected.map()));
  // And the next session goes on.
  auto writer = MapWriter::open(path, camera(), scales());
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  expected.grow(1);
  EXPECT_TRUE(writer->write(expected.map()).ok());
  EXPECT_TRUE(writer->close().ok());
  EXPECT_EQ(to_bytes(*load(path)), to_bytes(expected.map()));
}

/// YGSLAM_KILLS=50 for more instants.
TEST(MapWriter, KilledAtAnyInstantTheMapIsThere) {
  const char* text = std::getenv("YGSLAM_KILLS");
  const int kills = text == nullptr ? 10 : std::atoi(text);
  Rng rng(17);
  for (int i = 0; i < kills; ++i) {
    kill_at(static_cast<int>(rng.uniform(1'000, 400'000)));
    if (HasFatalFailure()) return;
  }
}

}  // namespace
}  // namespace ygslam
