// What a file keeps shorter than memory has it.
#include <fmt/format.h>

#include "map_file/map_file_testing.hpp"

namespace ygslam {
namespace {

using namespace map_file_test;  // NOLINT(google-build-using-namespace): its own helpers
using map_file::RowKey;
using map_file::Table;
using testing::TempFolder;

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
