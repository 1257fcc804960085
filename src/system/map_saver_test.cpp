#include "system/map_saver.hpp"

#include <gtest/gtest.h>

#include "io/testing/temp_folder.hpp"
#include "map/map_bytes.hpp"
#include "map_file/map_file.hpp"
#include "system/testing/painted_recording.hpp"

namespace ygslam::system_test {
namespace {

TEST(MapSaver, TheFileHasTheMapOfTheEnd) {
  const Recording recording = painted_recording({.seconds = 1});
  const SlamConfig config = small_config(DynamicMode::kOff);
  const PyramidScales scales(config.orb.levels, config.orb.scale_factor);
  const testing::TempFolder folder;
  const auto path = folder.path() / "room.ygmap";
  auto saver = MapSaver::open(path, recording.camera, scales, 0);
  ASSERT_TRUE(saver.ok()) << saver.error().message;
  const Trial trial =
      run(make_live_runner(config, recording.camera, nullptr,
                           {{}, false, [&](const Map& map) { (*saver)->look(map); }}),
          recording);
  ASSERT_TRUE((*saver)->finish(trial.map()).ok());
  const auto loaded = load_map(path, recording.camera, scales);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_EQ(to_bytes(*loaded), to_bytes(trial.map()));
}

}  // namespace
}  // namespace ygslam::system_test
