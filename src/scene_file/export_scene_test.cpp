#include "scene_file/export_scene.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "io/testing/file_size_limit.hpp"
#include "io/testing/temp_folder.hpp"
#include "scene/testing/sample_scene.hpp"
#include "scene_file/objects_file.hpp"

namespace ygslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using testing::read;
using testing::sample_scene;
using testing::SampleScene;
using testing::TempFolder;

SceneContent content_of(const SampleScene& scene) {
  return {scene.cloud, scene.mesh, scene.space, scene.objects, scene.gravity, GridOptions{}};
}

std::vector<std::string> files_of(const SceneFileKind& kind) {
  std::istringstream words{std::string(kind.files)};
  return {std::istream_iterator<std::string>(words), {}};
}

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), {}));
}

TEST(ExportScene, TheSameSceneGivesTheSameBytes) {
  const TempFolder first, second;
  ASSERT_TRUE(export_scene(first.path(), content_of(sample_scene(Vec3(0.1, -1, 0.2)))).ok());
  ASSERT_TRUE(export_scene(second.path(), content_of(sample_scene(Vec3(0.1, -1, 0.2)))).ok());
  std::size_t files = 0;
  for (const SceneFileKind& kind : scene_file_kinds()) {
    for (const std::string& file : files_of(kind)) {
      ++files;
      EXPECT_EQ(read(first.path() / file), read(second.path() / file)) << file;
      EXPECT_FALSE(read(first.path() / file).empty());
    }
  }
  EXPECT_EQ(entries(first.path()), files) << "and no other file";
}

TEST(ExportScene, AnEmptySceneGivesAllFilesAndPrintsNothing) {
  const TempFolder folder;
  ::testing::internal::CaptureStderr();
  ASSERT_TRUE(export_scene(folder.path(), content_of(SampleScene{})).ok());
  ASSERT_TRUE(export_scene(folder.path(), content_of(sample_scene(Vec3(0, 0, 1)))).ok());
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(entries(folder.path()), 10U);
}

TEST(ExportScene, AFullDiskLeavesTheOlderFileWhole) {
  const SampleScene scene = sample_scene(Vec3(0, -1, 0));
  for (const SceneFileKind& kind : scene_file_kinds()) {
    const TempFolder folder;
    for (const std::string& file : files_of(kind)) testing::write(folder.path() / file, "old");
    {
      const testing::FileSizeLimit full(100);
      const Status status = kind.write(folder.path(), content_of(scene));
      ASSERT_FALSE(status.ok()) << kind.name;
      EXPECT_EQ(status.error().kind, ErrorKind::kOutput);
      EXPECT_EQ(status.error().message.find((folder.path() / files_of(kind)[0]).string() + ": "),
                0U)
          << status.error().message;
    }
    for (const std::string& file : files_of(kind)) EXPECT_EQ(read(folder.path() / file), "old");
    EXPECT_EQ(entries(folder.path()), files_of(kind).size()) << "nothing half-written remains";
  }
}

TEST(ExportScene, AFolderThatIsNotThereIsAnOutputError) {
  const SampleScene scene;
  for (const SceneFileKind& kind : scene_file_kinds()) {
    const Status status = kind.write("/nonexistent/folder", content_of(scene));
    ASSERT_FALSE(status.ok()) << kind.name;
    EXPECT_EQ(status.error().kind, ErrorKind::kOutput);
  }
}

TEST(ExportScene, ObjectsTellClassStateAndBox) {
  const TempFolder folder;
  SampleScene scene = sample_scene(Vec3(0, 0, 1));
  const double yaw = 0.5;
  scene.objects[0].box.T_world_box =
      SE3(so3_exp(Vec3(0, 0, yaw)), scene.objects[0].box.T_world_box.t());
  ASSERT_TRUE(write_objects(folder.path() / "o.json", scene.objects, scene.gravity).ok());
  const Json json = Json::parse(read(folder.path() / "o.json"));
  EXPECT_EQ(json["up_world"], Json({0, 0, 1}));
  EXPECT_EQ(json["floor_m"], -1.2);
  ASSERT_EQ(json["objects"].size(), 3U);
  const Json expected = {{"id", 3},
                         {"class", "chair"},
                         {"label", 56},
                         {"probability", 0.75},
                         {"state", "static"},
                         {"box",
                          {{"centre_m", {-0.3, -0.1, -0.8}},
                           {"size_m", {0.4, 0.4, 0.8}},
                           {"yaw_rad", 0.5},
                           {"rotation_xyzw", {0, 0, 0.247404, 0.968912}}}},
                         {"views", 12},
                         {"epochs", 1},
                         {"first_seen_ns", 1'311'868'164'363'181'001},
                         {"last_seen_ns", 1'311'868'170'000'000'002}};
  EXPECT_EQ(json["objects"][0], expected);
  EXPECT_EQ(json["objects"][2]["state"], "absent");
}

TEST(ExportScene, EveryStateHasItsName) {
  const std::vector<std::string> names{"candidate", "static", "moving",
                                       "settled",   "absent", "unobserved"};
  for (std::size_t i = 0; i < names.size(); ++i)
    EXPECT_EQ(object_state_name(static_cast<ObjectState>(i)), names[i]);
}

}  // namespace
}  // namespace ygslam
