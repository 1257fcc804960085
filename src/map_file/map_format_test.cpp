// What a file keeps shorter than memory has it, and files of the first format.
#include "map_file/map_file_testing.hpp"

namespace ygslam {
namespace {

using namespace map_file_test;  // NOLINT(google-build-using-namespace): its own helpers
using map_file::RowKey;
using map_file::Table;
using testing::TempFolder;

// Of version 0.1.0, when the first format was the newest: three keyframes, five landmarks.
constexpr const char* kFirstFormat = "fuzz/corpus/map_file/first_format";

std::uint32_t format_of(const fs::path& path) {
  const auto opened = map_file::open_map(path);
  return opened.ok() ? opened->format : 0;
}

TEST(FirstFormat, IsRead) {
  ASSERT_EQ(format_of(kFirstFormat), 1U);
  const auto map = load_map(kFirstFormat);
  ASSERT_TRUE(map.ok()) << map.error().message;
  EXPECT_EQ(map->keyframes().size(), 3U);
  EXPECT_EQ(map->landmark_count(), 5U);
  map->for_each_landmark([&](const Landmark& landmark) {
    EXPECT_EQ(landmark.observations.size(), 3U);
    EXPECT_NE(landmark.descriptor, Descriptor{});
    EXPECT_NEAR(landmark.normal_world.norm(), 1, 1e-6);
    const LandmarkObservation& o = landmark.observations.front();
    const auto& data = *map->keyframe(o.keyframe).data;
    EXPECT_LT(distance(data.features->descriptors[o.feature], landmark.descriptor), 60);
    EXPECT_GT(data.features->points[o.feature].depth_m, 0);
  });
  const auto check = check_map(kFirstFormat);
  ASSERT_TRUE(check.ok());
  EXPECT_TRUE(check->faults.empty()) << check->faults.front();
}

TEST(FirstFormat, BecomesTheSecondWithTheFirstWrite) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  fs::copy_file(kFirstFormat, path);
  const auto before = load_map(path);
  ASSERT_TRUE(before.ok());
  const auto info = read_map_info(path);
  auto writer = MapWriter::open(path, Camera(info->camera), before->scales());
  ASSERT_TRUE(writer.ok()) << writer.error().message;
  EXPECT_EQ(format_of(path), 1U) << "until the first write";
  ASSERT_TRUE(writer->write(*before).ok());
  ASSERT_TRUE(writer->write(*before).ok());
  ASSERT_TRUE(writer->close().ok());
  EXPECT_EQ(format_of(path), 2U);
  const auto after = load_map(path);
  ASSERT_TRUE(after.ok()) << after.error().message;
  EXPECT_EQ(to_bytes(*after), to_bytes(*before));
  EXPECT_EQ(read_map_info(path)->uuid, info->uuid);
  EXPECT_EQ(read_map_info(path)->generation, info->generation + 2);
}

TEST(FirstFormat, DamageIsSeenInItsRowsToo) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const std::string whole = testing::read(kFirstFormat);
  Rng rng(4);
  for (const Table table : {Table::kSeen, Table::kWeight, Table::kLandmarks}) {
    for (int trial = 0; trial < 40; ++trial) {
      testing::write(path, whole);
      sign_row(path, {table, 0}, [&](std::string& raw) {
        if (trial % 2 == 0) {
          raw.resize(rng.below(static_cast<std::uint32_t>(raw.size())));
        } else {
          raw[rng.below(static_cast<std::uint32_t>(raw.size()))] ^=
              static_cast<char>(1 + rng.below(255));
        }
      });
      const auto map = load_map(path);
      if (trial % 2 == 0) {
        EXPECT_FALSE(map.ok()) << trial;
      }
      if (!map.ok()) continue;
      const Camera its(read_map_info(path)->camera);
      const fs::path saved = folder.path() / "saved.map";
      ASSERT_TRUE(save_map(saved, *map, its).ok());
      const auto again = load_map(saved);
      ASSERT_TRUE(again.ok()) << "accepted, but cannot be kept: " << again.error().message;
      EXPECT_EQ(to_bytes(*again), to_bytes(*map));
    }
  }
}

TEST(MapFormat, SavedAgainIsTheSame) {
  const TempFolder folder;
  const Map map = some_map();
  const auto rows_of = [&](const Map& saved, const char* name) {
    const fs::path path = folder.path() / name;
    EXPECT_TRUE(save_map(path, saved, camera()).ok());
    std::string rows;
    for (std::size_t table = 1; table < map_file::kTables; ++table)
      for (std::uint32_t id = 0; id < 8; ++id)
        rows += row_blob(path, {static_cast<Table>(table), id});
    return rows;
  };
  const std::string once = rows_of(map, "once.map");
  EXPECT_FALSE(once.empty());
  EXPECT_EQ(rows_of(*load(folder.path() / "once.map"), "twice.map"), once);
}

/// Where features lie without distortion follows from the camera, and is not kept.
TEST(MapFormat, ALensCostsNothing) {
  const TempFolder folder;
  CameraConfig config = camera().config();
  config.k1 = -0.2;
  config.k2 = 0.05;
  const Camera bent(config);
  const auto map_by = [&](const Camera& by) {
    map_test::World world(400, 8);
    Map map(scales());
    auto seen = world.see(SE3(), 0);
    auto features = std::make_shared<Features>(*seen.features);
    for (Feature& f : features->points)
      f.ideal_px = by.undistort(f.uv_px.cast<double>()).cast<float>();
    seen.features = features;
    seen.grid = FeatureGrid(*features, by.ideal_bounds());
    map_test::add_keyframe(map, seen, kNoKeyframe);
    return map;
  };
  const auto seen_bytes = [&](const Map& map, const Camera& saved_by) {
    const fs::path path = folder.path() / "room.map";
    EXPECT_TRUE(save_map(path, map, saved_by).ok());
    const auto back = load_map(path, saved_by, scales());
    EXPECT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(to_bytes(*back), to_bytes(map)) << "exact";
    return row_blob(path, {Table::kSeen, 0}).size();
  };
  EXPECT_EQ(seen_bytes(map_by(bent), bent), seen_bytes(map_by(camera()), camera()));
  EXPECT_GT(seen_bytes(map_by(camera()), bent), seen_bytes(map_by(bent), bent) + 1000)
      << "what the camera does not say is kept";
}

/// The keyframe whose descriptor a landmark has may be lost: then it gets another's.
TEST(MapFormat, ALandmarkGoesOnWithTheDescriptorsThatAreLeft) {
  const TempFolder folder;
  const fs::path path = folder.path() / "room.map";
  const fs::path rest = folder.path() / "rest.map";
  const Map map = some_map(9);
  for (const auto& [lost, keyframe] : map.keyframes()) {
    ASSERT_TRUE(save_map(path, map, camera()).ok());
    sql(path, fmt::format("DELETE FROM seen WHERE id = {}", index(lost)));
    fs::remove(rest);
    ASSERT_TRUE(recover_map(path, rest).ok());
    const auto back = load(rest);
    ASSERT_TRUE(back.ok()) << back.error().message;
    int same = 0;
    back->for_each_landmark([&](const Landmark& landmark) {
      const Landmark& before = map.landmark(landmark.id);
      bool of_a_kept_one = false;
      for (const LandmarkObservation& o : before.observations)
        of_a_kept_one |=
            o.keyframe != lost &&
            map.keyframe(o.keyframe).data->features->descriptors[o.feature] == before.descriptor;
      same += of_a_kept_one ? 1 : 0;
      if (of_a_kept_one) {
        EXPECT_EQ(landmark.descriptor, before.descriptor);
      } else {
        EXPECT_LT(distance(landmark.descriptor, before.descriptor), 40) << "of the same point";
      }
    });
    EXPECT_GT(same, 0);
  }
}

}  // namespace
}  // namespace ygslam
