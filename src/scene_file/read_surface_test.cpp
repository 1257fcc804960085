#include "scene_file/read_surface.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "io/testing/temp_folder.hpp"
#include "scene/testing/sample_scene.hpp"
#include "scene_file/labelled_cloud.hpp"
#include "scene_file/objects_file.hpp"
#include "scene_file/read_objects.hpp"

namespace ygslam {
namespace {

using testing::read;
using testing::sample_scene;
using testing::TempFolder;

void expect_equal(const SurfacePoint& a, const SurfacePoint& b) {
  EXPECT_EQ(a.p_world, b.p_world);
  EXPECT_EQ(a.normal_world, b.normal_world);
  EXPECT_EQ(a.colour, b.colour);
  EXPECT_EQ(a.label.semantic_class, b.label.semantic_class);
  EXPECT_EQ(a.label.object, b.label.object);
  EXPECT_EQ(a.label.probability, b.label.probability);
}

std::string mesh_bytes() {
  const TempFolder folder;
  const TriangleMesh mesh = sample_scene(Vec3(0, -1, 0)).mesh;
  EXPECT_TRUE(write_mesh_ply(folder.path() / "a.ply", mesh).ok());
  return read(folder.path() / "a.ply");
}

TEST(ReadSurface, AMeshIsWhatWasWritten) {
  const TriangleMesh mesh = sample_scene(Vec3(0, -1, 0)).mesh;
  const auto back = parse_surface_ply(mesh_bytes(), "a.ply");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->triangles, mesh.triangles);
  ASSERT_EQ(back->vertices.size(), mesh.vertices.size());
  ASSERT_FALSE(mesh.vertices.empty());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    expect_equal(back->vertices[i], mesh.vertices[i]);
}

void expect_refused(const std::string& bytes, const std::string& what) {
  const auto result = parse_surface_ply(bytes, "some.ply");
  ASSERT_FALSE(result.ok()) << what;
  EXPECT_EQ(result.error().kind, ErrorKind::kInput);
  EXPECT_EQ(result.error().message.rfind("some.ply: ", 0), 0U) << result.error().message;
  EXPECT_NE(result.error().message.find(what), std::string::npos) << result.error().message;
}

TEST(ReadSurface, EveryShorterFileIsRefused) {
  const std::string bytes = mesh_bytes();
  const std::size_t data = bytes.find("end_header\n") + 11;
  for (std::size_t size = 0; size < data; ++size) expect_refused(bytes.substr(0, size), "PLY");
  for (std::size_t size = data; size < bytes.size(); size += 97)
    expect_refused(bytes.substr(0, size), "truncated");
  expect_refused(bytes.substr(0, bytes.size() - 1), "truncated");
  expect_refused(bytes + "x", "more bytes");
}

std::string ply(const std::string& header, const std::string& data = {}) {
  return "ply\nformat binary_little_endian 1.0\n" + header + "end_header\n" + data;
}

// A fourth number behind those of a point at the origin.
std::string one_point(const std::string& name, double value) {
  std::string data(4 * sizeof value, '\0');
  std::memcpy(data.data() + 3 * sizeof value, &value, sizeof value);
  return ply(
      "element vertex 1\nproperty double x\nproperty double y\nproperty double z\n"
      "property double " +
          name + "\n",
      data);
}

TEST(ReadSurface, NumbersThatAreNotFiniteAreRefused) {
  for (const std::size_t offset : {0, 12, 31}) {  // x, nx, prob
    std::string bytes = mesh_bytes();
    const float value = std::numeric_limits<float>::quiet_NaN();
    std::memcpy(bytes.data() + bytes.find("end_header\n") + 11 + offset, &value, sizeof value);
    expect_refused(bytes, "not finite");
  }
  for (const char* name : {"red", "label"}) expect_refused(one_point(name, std::nan("")), "finite");
}

TEST(ReadSurface, PointsBeyondAllRoomsAreRefused) {
  EXPECT_TRUE(parse_surface_ply(one_point("nz", 1e8), "far.ply").ok());
  for (const double value : {1e10, -1e10, 1e300})
    for (const char* name : {"x", "nz"}) expect_refused(one_point(name, value), "beyond");
}

TEST(ReadSurface, ForeignFilesAreRefusedOrUnderstood) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  expect_refused("OFF\n3 1 0\n", "not a PLY");
  expect_refused("ply\nformat binary_middle_endian 1.0\nelement vertex 0\n" + xyz + "end_header\n",
                 "unknown format \"binary_middle_endian\"");
  expect_refused("ply\nelement vertex 0\n" + xyz + "end_header\n", "no format");
  expect_refused(ply("element vertex 99999999999999999\n" + xyz), "truncated");
  expect_refused(ply("element vertex -1\n" + xyz), "count");
  expect_refused(ply("element vertex 0\nproperty float x\n"), "without x, y and z");
  expect_refused(ply("element vertex 0\n"), "without x, y and z");
  expect_refused(ply("element vertex 0\nproperty quaternion x\n"), "property");
  expect_refused(ply("property float x\n"), "property");
  expect_refused(ply("element edge 0\n"), "no vertices");
  expect_refused(ply(""), "no vertices");
  const std::string quad = "property list uchar int vertex_index\n";
  expect_refused(ply("element vertex 0\n" + xyz + "element face 1\n" + quad,
                     std::string("\3\0\0\0\0\0\0\0\0\0\0\0\0", 13)),
                 "without its vertex");
  const auto fan = parse_surface_ply(
      ply("element vertex 4\n" + xyz + "property double quality\nelement face 1\n" + quad,
          std::string(80, '\0') + std::string("\4\0\0\0\0\1\0\0\0\2\0\0\0\3\0\0\0", 17)),
      "quad.ply");
  ASSERT_TRUE(fan.ok()) << fan.error().message;
  EXPECT_EQ(fan->triangles, (std::vector<std::array<std::uint32_t, 3>>{{{0, 1, 2}}, {{0, 2, 3}}}));
  EXPECT_EQ(fan->vertices[0].label.semantic_class, SemanticClass::kUnknown);
}

const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kColours = "property uchar red\nproperty uchar green\nproperty uchar blue\n";

std::string text_ply(const std::string& header, const std::string& rows) {
  return "ply\nformat ascii 1.0\n" + header + "end_header\n" + rows;
}

SurfacePoint only_point(const std::string& bytes) {
  const auto mesh = parse_surface_ply(bytes, "a.ply");
  EXPECT_TRUE(mesh.ok() && mesh->vertices.size() == 1) << (mesh.ok() ? "" : mesh.error().message);
  return mesh.ok() && !mesh->vertices.empty() ? mesh->vertices.front() : SurfacePoint{};
}

TEST(ReadSurface, TextIsRead) {
  const SurfacePoint point = only_point(text_ply(
      "comment of MeshLab\nelement vertex 1\n" + kXyz + kColours + "property float quality\n",
      "1.5 -2 3e-1 200 40 41 nan\n"));
  EXPECT_EQ(point.p_world, Eigen::Vector3f(1.5F, -2, 0.3F));
  EXPECT_EQ(point.colour, (Rgb8{200, 40, 41}));
  const auto mesh =
      parse_surface_ply(text_ply("element vertex 3\n" + kXyz +
                                     "element face 1\nproperty list uchar int vertex_index\n",
                                 "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n\n"),
                        "a.ply");
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 1U);
  const std::string head = "element vertex 2\n" + kXyz;
  expect_refused(text_ply(head, "1 2 3\n1 2\n"), "truncated");
  expect_refused(text_ply(head, "1 2 3\n1 2 3\n4\n"), "more bytes");
  expect_refused(text_ply(head, "1 2 3\n1 x 3\n"), "'x' is no number");
  expect_refused(text_ply(head, "1 2 3\n1 nan 3\n"), "not finite");
  expect_refused(text_ply("element vertex 99999999999\n" + kXyz, "1 2 3\n"), "truncated");
}

TEST(ReadSurface, BigEndianAndLinesWithCarriageReturnsAreRead) {
  const std::string head = "element vertex 1\n" + kXyz;
  const std::string one_and_two("\x3f\x80\0\0\x40\0\0\0\0\0\0\0", 12);
  EXPECT_EQ(only_point("ply\nformat binary_big_endian 1.0\n" + head + "end_header\n" + one_and_two)
                .p_world,
            Eigen::Vector3f(1, 2, 0));
  std::string crlf = ply(head);
  for (std::size_t at = 0; (at = crlf.find('\n', at)) != std::string::npos; at += 2)
    crlf.replace(at, 1, "\r\n");
  const std::string two("\0\0\0\x40\0\0\0\0\0\0\0\0", 12);
  EXPECT_EQ(only_point(crlf + two).p_world, Eigen::Vector3f(2, 0, 0));
}

TEST(ReadSurface, ElementsAndListsThatAreNotKnownArePassedOver) {
  const std::string zeros(12, '\0');
  EXPECT_EQ(only_point(ply("element vertex 1\n" + kXyz +
                               "element camera 1\nproperty float view_px\nproperty int viewportx\n",
                           zeros + std::string(8, 'x')))
                .p_world.norm(),
            0)
      << "PCL's";
  EXPECT_EQ(only_point(text_ply("element material 2\nproperty int id\nelement vertex 1\n"
                                "property list uchar float weights\n" +
                                    kXyz,
                                "7\n8\n2 0.5 0.5 1 2 3\n"))
                .p_world,
            Eigen::Vector3f(1, 2, 3));
}

TEST(ReadSurface, ColoursAreBytesPartsOfOneOrGrey) {
  const std::string float_colours =
      "property float red\nproperty float green\nproperty float blue\n";
  const auto colour = [](const std::string& properties, const std::string& row) {
    return only_point(text_ply("element vertex 1\n" + kXyz + properties, "0 0 0 " + row)).colour;
  };
  EXPECT_EQ(colour(float_colours, "0.784314 0.156863 1"), (Rgb8{200, 40, 255}));
  EXPECT_EQ(colour(float_colours, "200 40 255"), (Rgb8{200, 40, 255}));
  EXPECT_EQ(colour("property uchar diffuse_blue\nproperty uchar diffuse_green\n"
                   "property uchar diffuse_red\n",
                   "3 2 1"),
            (Rgb8{1, 2, 3}));
  EXPECT_EQ(colour(kColours, "1 1 1"), (Rgb8{1, 1, 1})) << "bytes are bytes";
  EXPECT_EQ(colour("", ""), (Rgb8{160, 160, 160})) << "not black";
  EXPECT_EQ(colour("property uchar red\n", "7"), (Rgb8{160, 160, 160}));
}

TEST(ReadObjects, AreWhatWasWritten) {
  const TempFolder folder;
  auto scene = sample_scene(Vec3(0, -1, 0));
  ASSERT_EQ(scene.objects.size(), 3U);
  scene.objects[0].earlier = {{scene.objects[1].box, {1}, {2}, {3}},
                              {scene.objects[2].box, {4}, {5}, {6}}};
  scene.objects[2].found_empty = Timestamp{7};
  scene.objects[1].known = Timestamp{8};
  ASSERT_TRUE(write_objects(folder.path() / "o.json", scene.objects, scene.gravity).ok());
  const auto back = read_objects(folder.path() / "o.json");
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_LT((back->gravity.up_world - scene.gravity.up_world.normalized()).norm(), 2e-6);
  EXPECT_NEAR(back->gravity.floor_m, scene.gravity.floor_m, 1e-6);
  ASSERT_EQ(back->objects.size(), scene.objects.size());
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const SceneObject &a = scene.objects[i], &b = back->objects[i];
    EXPECT_EQ(object_name(a), object_name(b));
    EXPECT_EQ(a.state, b.state);
    EXPECT_LT((a.box.size_m - b.box.size_m).norm(), 2e-6);
    EXPECT_LT((a.box.T_world_box.t() - b.box.T_world_box.t()).norm(), 2e-6);
    EXPECT_LT((a.box.T_world_box.R() - b.box.T_world_box.R()).norm(), 1e-5);
    EXPECT_EQ(a.found_empty, b.found_empty);
    EXPECT_EQ(a.known, b.known);
    ASSERT_EQ(a.earlier.size(), b.earlier.size());
    for (std::size_t k = 0; k < a.earlier.size(); ++k) {
      EXPECT_LT((a.earlier[k].box.size_m - b.earlier[k].box.size_m).norm(), 2e-6);
      EXPECT_EQ(a.earlier[k].first_seen, b.earlier[k].first_seen);
      EXPECT_EQ(a.earlier[k].last_seen, b.earlier[k].last_seen);
      EXPECT_EQ(a.earlier[k].found_empty, b.earlier[k].found_empty);
    }
  }
}

TEST(ReadObjects, ABadNumberIsRefused) {
  const TempFolder folder;
  const auto scene = sample_scene(Vec3(0, -1, 0));
  ASSERT_TRUE(write_objects(folder.path() / "o.json", scene.objects, scene.gravity).ok());
  const nlohmann::json good = nlohmann::json::parse(read(folder.path() / "o.json"));
  using Pointer = nlohmann::json::json_pointer;
  for (const auto& [where, value] : std::initializer_list<std::pair<const char*, nlohmann::json>>{
           {"/objects/0/id", 65536},
           {"/objects/0/id", -1},
           {"/objects/0/label", 1e300},
           {"/objects/0/probability", 1.5},
           {"/objects/0/views", 1e10},
           {"/objects/0/last_seen_ns", 1ULL << 63U},
           {"/objects/0/box/size_m/1", -0.1},
           {"/objects/0/box/centre_m/0", 1e300},
           {"/up_world/2", 1e200},
           {"/floor_m", -1e10}}) {
    nlohmann::json json = good;
    ASSERT_TRUE(json.contains(Pointer(where))) << where;
    json[Pointer(where)] = value;
    EXPECT_FALSE(parse_objects(json.dump(), "o.json").ok()) << where;
  }
  EXPECT_TRUE(parse_objects(good.dump(), "o.json").ok());
}

TEST(ReadObjects, FaultsAreToldInOurWords) {
  const TempFolder folder;
  const auto scene = sample_scene(Vec3(0, -1, 0));
  ASSERT_TRUE(write_objects(folder.path() / "o.json", scene.objects, scene.gravity).ok());
  const nlohmann::json good = nlohmann::json::parse(read(folder.path() / "o.json"));
  using Pointer = nlohmann::json::json_pointer;
  const auto told_of = [&](const char* where, const nlohmann::json& value) {
    nlohmann::json json = good;
    json[Pointer(where)] = value;
    const auto result = parse_objects(json.dump(), "o.json");
    return result.ok() ? "accepted" : result.error().message;
  };
  EXPECT_EQ(told_of("/objects/1/views", "x"),
            "o.json: objects: number 2: views: a number that is not whole");
  EXPECT_EQ(told_of("/objects/0/box/size_m", nullptr),
            "o.json: objects: number 1: box: size_m: no list where one is expected");
  EXPECT_EQ(told_of("/objects", 7), "o.json: objects: no list where one is expected");
  EXPECT_EQ(told_of("/up_world/1", "y"), "o.json: up_world: no number where one is expected");
  nlohmann::json json = good;
  json.erase("floor_m");
  EXPECT_EQ(parse_objects(json.dump(), "o.json").error().message, "o.json: 'floor_m' is missing");
  EXPECT_EQ(parse_objects("[]", "o.json").error().message,
            "o.json: no object where one is expected");
}

TEST(ReadObjects, AnythingElseIsRefused) {
  for (const char* text : {"", "{", "[]", "{}", R"({"format": "ygslam labels"})",
                           R"({"format": "ygslam objects", "up_world": [0, 0, 0]})",
                           R"({"format": "ygslam objects", "up_world": [0, 1]})"}) {
    const auto result = parse_objects(text, "o.json");
    ASSERT_FALSE(result.ok()) << text;
    EXPECT_EQ(result.error().kind, ErrorKind::kInput);
    EXPECT_EQ(result.error().message.rfind("o.json: ", 0), 0U);
    EXPECT_EQ(result.error().message.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace ygslam
