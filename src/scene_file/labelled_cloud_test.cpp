#include "scene_file/labelled_cloud.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "io/testing/temp_folder.hpp"
#include "scene/testing/sample_scene.hpp"

namespace ygslam {
namespace {

using testing::read;
using testing::sample_scene;
using testing::TempFolder;

constexpr std::size_t kPlyPointBytes = 35;

template <typename T>
T value_at(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

void expect_ply_point(const std::string& bytes, std::size_t at, const SurfacePoint& point) {
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(value_at<float>(bytes, at + 4 * i), point.p_world[static_cast<int>(i)]);
    ASSERT_EQ(value_at<float>(bytes, at + 12 + 4 * i), point.normal_world[static_cast<int>(i)]);
  }
  ASSERT_EQ(value_at<Rgb8>(bytes, at + 24), point.colour);
  ASSERT_EQ(value_at<std::uint16_t>(bytes, at + 27), static_cast<int>(point.label.semantic_class));
  ASSERT_EQ(value_at<std::uint16_t>(bytes, at + 29), static_cast<int>(point.label.object));
  ASSERT_EQ(value_at<float>(bytes, at + 31), point.label.probability);
}

std::size_t data_offset(const std::string& bytes, const std::string& last_line) {
  return bytes.find(last_line) + last_line.size();
}

TEST(LabelledCloud, EveryFieldIsWhereThePlyHeaderSays) {
  const TempFolder folder;
  const auto cloud = sample_scene(Vec3(0, -1, 0)).cloud;
  ASSERT_TRUE(write_labelled_ply(folder.path() / "a.ply", cloud).ok());
  const std::string bytes = read(folder.path() / "a.ply");
  EXPECT_EQ(bytes.substr(0, data_offset(bytes, "end_header\n")),
            "ply\nformat binary_little_endian 1.0\ncomment label 56 chair\n"
            "comment label 60 dining table\ncomment label 80 floor\ncomment label 81 wall\n"
            "comment label 82 ceiling\ncomment label 255 unknown\nelement vertex 1000\n"
            "property float x\nproperty float y\nproperty float z\nproperty float nx\n"
            "property float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n"
            "property uchar blue\nproperty uint16 label\nproperty uint16 instance\n"
            "property float prob\nend_header\n");
  const std::size_t first = data_offset(bytes, "end_header\n");
  ASSERT_EQ(bytes.size() - first, cloud.size() * kPlyPointBytes);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    expect_ply_point(bytes, first + i * kPlyPointBytes, cloud[i]);
}

TEST(LabelledCloud, TrianglesFollowTheirVertices) {
  const TempFolder folder;
  const TriangleMesh mesh = sample_scene(Vec3(0, 0, 1)).mesh;
  ASSERT_TRUE(write_mesh_ply(folder.path() / "a.ply", mesh).ok());
  const std::string bytes = read(folder.path() / "a.ply");
  const std::string count = std::to_string(mesh.triangles.size());
  EXPECT_NE(bytes.find("\nelement face " + count +
                       "\nproperty list uchar int vertex_indices\nend_header\n"),
            std::string::npos);
  std::size_t at = data_offset(bytes, "end_header\n");
  for (const SurfacePoint& vertex : mesh.vertices) {
    expect_ply_point(bytes, at, vertex);
    at += kPlyPointBytes;
  }
  ASSERT_EQ(bytes.size() - at, mesh.triangles.size() * 13);
  for (const auto& triangle : mesh.triangles) {
    ASSERT_EQ(bytes[at], 3);
    for (std::size_t i = 0; i < 3; ++i)
      ASSERT_EQ(value_at<std::uint32_t>(bytes, at + 1 + 4 * i), triangle[i]);
    at += 13;
  }
}

TEST(LabelledCloud, PcdPointsAreThoseOfPointXyzRgbL) {
  const TempFolder folder;
  const auto cloud = sample_scene(Vec3(1, 0, 0)).cloud;
  ASSERT_TRUE(write_pcd(folder.path() / "a.pcd", cloud).ok());
  const std::string bytes = read(folder.path() / "a.pcd");
  std::size_t at = data_offset(bytes, "DATA binary\n");
  ASSERT_EQ(bytes.size() - at, cloud.size() * 20);
  for (const SurfacePoint& point : cloud) {
    const Rgb8 c = point.colour;
    ASSERT_EQ(value_at<float>(bytes, at + 8), point.p_world.z());
    ASSERT_EQ(value_at<std::uint32_t>(bytes, at + 12), c.r << 16 | c.g << 8 | c.b);
    ASSERT_EQ(value_at<std::uint32_t>(bytes, at + 16),
              static_cast<std::uint32_t>(point.label.semantic_class));
    at += 20;
  }
}

TEST(LabelledCloud, APointThatIsNotFiniteIsABugAndTheOlderFileStays) {
  const TempFolder folder;
  const auto path = folder.path() / "a.ply";
  testing::write(path, "old");
  std::vector<SurfacePoint> cloud(3);
  cloud[2].p_world.y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW((void)write_labelled_ply(path, cloud), InternalError);
  EXPECT_THROW((void)write_pcd(path, cloud), InternalError);
  cloud[2] = {};
  EXPECT_THROW((void)write_mesh_ply(path, {cloud, {{0, 1, 3}}}), InternalError);
  EXPECT_EQ(read(path), "old");
}

}  // namespace
}  // namespace ygslam
