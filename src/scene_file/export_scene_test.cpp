#include "scene_file/export_scene.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
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
  EXPECT_EQ(entries(folder.path()), 11U);
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

Json point_json(const SurfacePoint& point) {
  return {point.p_world.x(),
          point.p_world.y(),
          point.p_world.z(),
          point.normal_world.x(),
          point.normal_world.y(),
          point.normal_world.z(),
          point.colour.r,
          point.colour.g,
          point.colour.b,
          static_cast<int>(point.label.semantic_class),
          static_cast<int>(point.label.object),
          point.label.probability};
}

Json cell_json(const SpaceCell& cell) {
  return {cell.index.x(),
          cell.index.y(),
          cell.index.z(),
          static_cast<int>(cell.state),
          cell.log_odds,
          cell.colour.r,
          cell.colour.g,
          cell.colour.b,
          static_cast<int>(cell.label.semantic_class),
          static_cast<int>(cell.label.object),
          cell.label.probability};
}

Json vector_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

// The scene as it lies in memory, for readers of the files to compare with.
Json scene_json(const SampleScene& scene) {
  Json json = {
      {"cell_m", scene.space.cell_m},     {"up_world", vector_json(scene.gravity.up_world)},
      {"floor_m", scene.gravity.floor_m}, {"cloud", Json::array()},
      {"vertices", Json::array()},        {"triangles", scene.mesh.triangles},
      {"cells", Json::array()},           {"objects", Json::array()}};
  for (const SurfacePoint& point : scene.cloud) json["cloud"].push_back(point_json(point));
  for (const SurfacePoint& point : scene.mesh.vertices)
    json["vertices"].push_back(point_json(point));
  for (const SpaceCell& cell : scene.space.cells) json["cells"].push_back(cell_json(cell));
  for (const SceneObject& object : scene.objects) {
    const Mat3& R = object.box.T_world_box.R();
    json["objects"].push_back(
        {{"id", static_cast<int>(object.id)},
         {"label", static_cast<int>(object.semantic_class)},
         {"state", object_state_name(object.state)},
         {"centre_m", vector_json(object.box.T_world_box.t())},
         {"axes", {vector_json(R.col(0)), vector_json(R.col(1)), vector_json(R.col(2))}},
         {"size_m", vector_json(object.box.size_m)}});
  }
  return json;
}

// Writes sample scenes for tests/scene_file_test.py and tests/scene_space_file_test.py into
// $YGSLAM_SAMPLE_SCENES.
TEST(ExportScene, SamplesForOtherReaders) {
  const char* folder = std::getenv("YGSLAM_SAMPLE_SCENES");
  if (folder == nullptr) GTEST_SKIP() << "$YGSLAM_SAMPLE_SCENES is not set";
  SampleScene empty;
  empty.gravity.up_world = Vec3(0, -1, 0);
  for (const auto& [name, scene] :
       {std::pair{"level", sample_scene(Vec3(0, 0, 1))},
        std::pair{"camera", sample_scene(Vec3(0, -1, 0))},
        std::pair{"tilted", sample_scene(Vec3(0.1, -1, 0.2))}, std::pair{"empty", empty}}) {
    const fs::path out = fs::path(folder) / name;
    fs::create_directories(out);
    const Status written = export_scene(out, content_of(scene));
    ASSERT_TRUE(written.ok()) << written.error().message;
    testing::write(out / "truth.json", scene_json(scene).dump());
  }
}

}  // namespace
}  // namespace ygslam
