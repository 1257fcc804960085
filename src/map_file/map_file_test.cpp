#include "map_file/map_file.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include "io/testing/file_size_limit.hpp"
#include "map_file/map_file_testing.hpp"

namespace ygslam {
namespace {

using map_file_test::camera;
using map_file_test::GrowingMap;
using map_file_test::load;
using map_file_test::names_in;
using map_file_test::Nobody;
using map_file_test::scales;
using map_file_test::some_map;
using testing::TempFolder;
namespace fs = std::filesystem;

TEST(MapFile, ComesBackAsItWas) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const Map map = some_map();
  ASSERT_FALSE(map.removed_keyframes().empty());
  const Status saved = save_map(path, map, camera());
  ASSERT_TRUE(saved.ok()) << saved.error().message;
  const auto back = load(path);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(to_bytes(*back), to_bytes(map));
  for (const auto& [id, keyframe] : map.keyframes()) {
    EXPECT_EQ(back->keyframe(id).landmarks, keyframe.landmarks);
    EXPECT_EQ(back->keyframe(id).covisible, keyframe.covisible);
    EXPECT_EQ(back->keyframe(id).data->grid.size(), keyframe.data->grid.size());
  }
  EXPECT_EQ(back->next_keyframe_id(), map.next_keyframe_id());
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"room.map"});
}

TEST(MapFile, SmallMapsComeBackToo) {
  const TempFolder folder;
  const fs::path path = folder.path() / "small.map";
  for (const int keyframes : {0, 1}) {
    const Map map = some_map(keyframes);
    ASSERT_TRUE(save_map(path, map, camera()).ok());
    const auto back = load(path);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(to_bytes(*back), to_bytes(map));
  }
  map_test::World world(50, 3);
  Map without_landmarks(scales());
  map_test::add_keyframe(without_landmarks, world.see(SE3(), 0), kNoKeyframe);
  ASSERT_TRUE(save_map(path, without_landmarks, camera()).ok());
  const auto back = load(path);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(to_bytes(*back), to_bytes(without_landmarks));
}

TEST(MapFile, TellsWhatItHolds) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const Map map = some_map();
  ASSERT_TRUE(save_map(path, map, camera()).ok());
  const auto info = read_map_info(path);
  ASSERT_TRUE(info.ok()) << info.error().message;
  EXPECT_EQ(info->keyframes, map.keyframes().size());
  EXPECT_EQ(info->removed_keyframes, map.removed_keyframes().size());
  EXPECT_EQ(info->landmarks, map.landmark_count());
  EXPECT_GT(info->observations, info->landmarks);
  EXPECT_EQ(info->camera.fx, camera().fx());
  EXPECT_EQ(info->pyramid_levels, map_test::kLevels);
  EXPECT_EQ(info->generation, 1U);
  EXPECT_EQ(info->bytes, fs::file_size(path));
  EXPECT_EQ(info->uuid.size(), 36U);
  const auto check = check_map(path);
  ASSERT_TRUE(check.ok());
  EXPECT_TRUE(check->faults.empty()) << check->faults.front();
}

TEST(MapFile, OpensForTheSameCameraAndPyramidOnly) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  ASSERT_TRUE(save_map(path, some_map(2), camera()).ok());
  CameraConfig other = camera().config();
  other.depth_scale = 1000;
  other.colour_readout_ms = 5;
  EXPECT_TRUE(load_map(path, Camera(other), scales()).ok())
      << "not what decides where features lie";
  other.fx = 535.4;
  const auto refused = load_map(path, Camera(other), scales());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::kSavedMap);
  EXPECT_NE(refused.error().message.find("fx 525 (here 535.4)"), std::string::npos)
      << refused.error().message;
  const auto pyramid = load_map(path, camera(), {map_test::kLevels, 1.3});
  ASSERT_FALSE(pyramid.ok());
  EXPECT_NE(pyramid.error().message.find("pyramid factor 1.2 (here 1.3)"), std::string::npos);
  EXPECT_TRUE(load_map(path).ok()) << "to look at, any camera's map will do";
}

TEST(MapFile, OlderFileStaysWholeWhenTheDiskIsFull) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const Map old = some_map(1);
  ASSERT_TRUE(save_map(path, old, camera()).ok());
  const Map map = some_map();
  const fs::path whole = folder.path() / "whole.map";
  ASSERT_TRUE(save_map(whole, map, camera()).ok());
  const auto bytes = fs::file_size(whole);
  fs::remove(whole);
  for (rlim_t limit = 0; limit < bytes; limit += 5000) {
    const testing::FileSizeLimit full(limit);
    const Status saved = save_map(path, map, camera());
    ASSERT_FALSE(saved.ok()) << limit;
    EXPECT_EQ(saved.error().kind, ErrorKind::kOutput);
    EXPECT_NE(saved.error().message.find("room.map: "), std::string::npos) << saved.error().message;
    const auto back = load(path);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(to_bytes(*back), to_bytes(old));
    EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{"room.map"}) << limit;
  }
  EXPECT_TRUE(save_map(path, map, camera()).ok());
}

TEST(MapFile, NothingIsLeftOfALargeMapWhenTheDiskIsFull) {
  const TempFolder folder;
  GrowingMap growing(3000);
  growing.grow(40);  // more than SQLite keeps in memory
  const testing::FileSizeLimit full(1 << 20);
  ASSERT_FALSE(save_map(folder.path() / "room.map", growing.map(), camera()).ok());
  EXPECT_EQ(names_in(folder.path()), std::vector<std::string>{});
}

TEST(MapFile, ReadOnlyFolderIsToldOfAndReadFrom) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const Map map = some_map(2);
  ASSERT_TRUE(save_map(path, map, camera()).ok());
  auto writer = MapWriter::open(path, camera(), scales());
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE(writer->write(map).ok());
  ASSERT_TRUE(writer->close().ok());
  fs::permissions(folder.path(), fs::perms(0555));
  {
    const Nobody nobody;
    const Status saved = save_map(path, map, camera());
    ASSERT_FALSE(saved.ok());
    EXPECT_EQ(saved.error().kind, ErrorKind::kOutput);
    EXPECT_NE(saved.error().message.find("Permission denied"), std::string::npos)
        << saved.error().message;
    EXPECT_FALSE(MapWriter::open(path, camera(), scales()).ok());
    const auto back = load(path);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(to_bytes(*back), to_bytes(map));
  }
  fs::permissions(folder.path(), fs::perms(0755));
}

TEST(MapFile, AnyNameWillDo) {
  const TempFolder folder("map file ");
  const Map map = some_map(2);
  for (const std::string& name :
       {std::string("mit Leerzeichen.map"), std::string("Wohnzimmer-größer-部屋.map"),
        std::string("100%?#&mode=ro"), std::string(255, 'n')}) {
    const fs::path path = folder.path() / name;
    const Status saved = save_map(path, map, camera());
    ASSERT_TRUE(saved.ok()) << saved.error().message;
    const auto back = load(path);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(to_bytes(*back), to_bytes(map));
  }
  const fs::path too_long = folder.path() / std::string(256, 'n');
  EXPECT_EQ(save_map(too_long, map, camera()).error().kind, ErrorKind::kOutput);
  EXPECT_EQ(save_map(folder.path() / "none" / "a.map", map, camera()).error().kind,
            ErrorKind::kOutput);
}

TEST(MapFile, LinksStay) {
  const TempFolder folder;
  const TempFolder elsewhere;
  const fs::path link = folder.path() / "link.map";
  const fs::path target = elsewhere.path() / "room.map";
  fs::create_symlink(target, link);
  EXPECT_EQ(save_map(link, some_map(1), camera()).error().kind, ErrorKind::kOutput)
      << "where it leads nobody knows";
  ASSERT_TRUE(save_map(target, some_map(1), camera()).ok());
  const Map map = some_map(3);
  ASSERT_TRUE(save_map(link, map, camera()).ok());
  EXPECT_TRUE(fs::is_symlink(link));
  const auto back = load(target);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(to_bytes(*back), to_bytes(map));
  EXPECT_EQ(to_bytes(*load(link)), to_bytes(map));
}

TEST(MapFile, ReplacesMapsOnly) {
  const TempFolder folder;
  const fs::path letter = folder.path() / "letter.txt";
  testing::write(letter, "Dear all,\n");
  const Status saved = save_map(letter, some_map(1), camera());
  ASSERT_FALSE(saved.ok());
  EXPECT_EQ(saved.error().kind, ErrorKind::kOutput);
  EXPECT_EQ(testing::read(letter), "Dear all,\n");
  EXPECT_FALSE(save_map(folder.path(), some_map(1), camera()).ok()) << "a folder";
  EXPECT_FALSE(save_map("/dev/null", some_map(1), camera()).ok());
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  const fs::path empty = folder.path() / "empty";
  testing::write(empty, "");
  EXPECT_TRUE(save_map(empty, some_map(1), camera()).ok());
}

}  // namespace
}  // namespace ygslam
