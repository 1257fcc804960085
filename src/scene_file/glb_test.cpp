#include "scene_file/glb.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "io/testing/temp_folder.hpp"
#include "scene/testing/sample_scene.hpp"

namespace ygslam {
namespace {

using testing::sample_scene;
using testing::SampleScene;

struct GlbContent {
  nlohmann::json json;
  std::string binary;
};

std::uint32_t number_at(const std::string& bytes, std::size_t offset) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

GlbContent read_glb(const std::filesystem::path& path) {
  const std::string bytes = testing::read(path);
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(number_at(bytes, 4), 2U);
  EXPECT_EQ(number_at(bytes, 8), bytes.size());
  const std::size_t json_bytes = number_at(bytes, 12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  GlbContent content{nlohmann::json::parse(bytes.substr(20, json_bytes)), {}};
  const std::size_t rest = 20 + json_bytes;
  if (rest == bytes.size()) return content;
  EXPECT_EQ(rest % 4, 0U);
  EXPECT_EQ(bytes.substr(rest + 4, 4), std::string("BIN\0", 4));
  content.binary = bytes.substr(rest + 8);
  EXPECT_EQ(number_at(bytes, rest), content.binary.size());
  return content;
}

GlbContent written(const SampleScene& scene) {
  const testing::TempFolder folder;
  const auto path = folder.path() / "a.glb";
  EXPECT_TRUE(write_glb(path, scene.mesh, scene.objects, scene.gravity).ok());
  return read_glb(path);
}

// The bytes of one element of an accessor.
std::string element(const GlbContent& glb, const nlohmann::json& accessor, std::size_t i,
                    std::size_t size) {
  const auto& view = glb.json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
  const std::size_t offset =
      view.value("byteOffset", 0UL) + accessor["byteOffset"].get<std::size_t>();
  return glb.binary.substr(offset + i * view.value("byteStride", size), size);
}

TEST(Glb, EachObjectIsANodeWithItsTriangles) {
  const SampleScene scene = sample_scene(Vec3(0, 0, 1));
  const GlbContent glb = written(scene);
  const auto& nodes = glb.json["nodes"];
  ASSERT_EQ(nodes.size(), 2 + scene.objects.size());
  EXPECT_EQ(nodes[0]["children"], nlohmann::json({1, 2, 3, 4}));
  EXPECT_EQ(nodes[1]["name"], "background");
  EXPECT_EQ(nodes[2]["name"], "chair 3");
  EXPECT_EQ(nodes[3]["name"], "dining table 700");
  EXPECT_FALSE(nodes[4].contains("mesh")) << "absent: no triangle is left of it";
  EXPECT_EQ(nodes[4]["extras"]["state"], "absent");
  EXPECT_EQ(nodes[2]["extras"]["box"]["size_m"], nlohmann::json({0.4, 0.4, 0.8}));

  std::size_t triangles = 0;
  for (const std::size_t node : {1U, 2U, 3U}) {
    const auto& primitive =
        glb.json["meshes"][nodes[node]["mesh"].get<std::size_t>()]["primitives"][0];
    const auto& indices = glb.json["accessors"][primitive["indices"].get<std::size_t>()];
    const auto& instance =
        glb.json["accessors"][primitive["attributes"]["_INSTANCE"].get<std::size_t>()];
    const auto count = indices["count"].get<std::size_t>();
    triangles += count / 3;
    if (node == 1) continue;
    EXPECT_EQ(count, node == 2 ? 13 * 3U : 12 * 3U);
    std::size_t foreign = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t vertex = number_at(element(glb, indices, i, 4), 0);
      ASSERT_LT(vertex, instance["count"].get<std::uint32_t>());
      std::uint16_t id = 0;
      std::memcpy(&id, element(glb, instance, vertex, 2).data(), 2);
      foreign += id != nodes[node]["extras"]["id"].get<int>();
    }
    EXPECT_EQ(foreign, node == 2 ? 1U : 0U) << "the corner of the floor";
  }
  EXPECT_EQ(triangles, scene.mesh.triangles.size());
}

TEST(Glb, FieldsAreAlignedAndBoundsAreExact) {
  const GlbContent glb = written(sample_scene(Vec3(0.1, -1, 0.2)));
  EXPECT_EQ(glb.json["buffers"][0]["byteLength"], glb.binary.size());
  for (const auto& mesh : glb.json["meshes"]) {
    const auto& attributes = mesh["primitives"][0]["attributes"];
    for (const auto& [name, number] : attributes.items()) {
      EXPECT_EQ(glb.json["accessors"][number.get<std::size_t>()]["byteOffset"].get<int>() % 4, 0);
    }
    const auto& position = glb.json["accessors"][attributes["POSITION"].get<std::size_t>()];
    Eigen::Vector3f low = Eigen::Vector3f::Constant(1e9F), high = -low;
    for (std::size_t i = 0; i < position["count"]; ++i) {
      Eigen::Vector3f p;
      std::memcpy(p.data(), element(glb, position, i, 12).data(), 12);
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(position["min"][static_cast<std::size_t>(i)].get<float>(), low[i]);
      EXPECT_EQ(position["max"][static_cast<std::size_t>(i)].get<float>(), high[i]);
    }
  }
}

TEST(Glb, TheRootTurnsUpIntoY) {
  for (const Vec3& up : {Vec3(0, 0, 1), Vec3(0, -1, 0), Vec3(0, 1, 0), Vec3(0.3, -2, 0.4)}) {
    const auto q = written(sample_scene(up)).json["nodes"][0]["rotation"];
    const Eigen::Quaterniond turn(q[3].get<double>(), q[0].get<double>(), q[1].get<double>(),
                                  q[2].get<double>());
    EXPECT_NEAR(turn.norm(), 1, 1e-12);
    EXPECT_NEAR((turn * up.normalized()).y(), 1, 1e-12);
  }
}

TEST(Glb, ColoursAreLinearAndNormalsOfUnitLength) {
  SampleScene scene;
  scene.mesh.vertices.resize(3);
  scene.mesh.vertices[0].colour = {0, 188, 255};
  scene.mesh.vertices[0].normal_world = Eigen::Vector3f(0, 3, 0);
  scene.mesh.triangles = {{0, 1, 2}};
  const GlbContent glb = written(scene);
  const auto& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
  const auto floats = [&](const char* name, std::size_t i) {
    std::array<float, 3> value{};
    std::memcpy(
        value.data(),
        element(glb, glb.json["accessors"][attributes[name].get<std::size_t>()], i, 12).data(), 12);
    return value;
  };
  EXPECT_EQ(floats("NORMAL", 0), (std::array{0.0F, 1.0F, 0.0F}));
  EXPECT_EQ(floats("NORMAL", 1), (std::array{0.0F, 0.0F, 1.0F})) << "unknown: up";
  std::array<std::uint16_t, 4> colour{};
  std::memcpy(
      colour.data(),
      element(glb, glb.json["accessors"][attributes["COLOR_0"].get<std::size_t>()], 0, 8).data(),
      8);
  EXPECT_EQ(colour[0], 0);
  EXPECT_NEAR(colour[1], 65535 * 0.503, 65);  // half of the light is 188 of 255 in sRGB
  EXPECT_EQ(colour[2], 65535);
  EXPECT_EQ(colour[3], 65535);
}

TEST(Glb, AnEmptyMeshHasNodesAndNoBuffer) {
  SampleScene scene = sample_scene(Vec3(0, 0, 1));
  scene.mesh = {};
  const GlbContent glb = written(scene);
  EXPECT_TRUE(glb.binary.empty());
  EXPECT_FALSE(glb.json.contains("buffers"));
  EXPECT_FALSE(glb.json.contains("meshes"));
  EXPECT_EQ(glb.json["nodes"].size(), 5U);
}

}  // namespace
}  // namespace ygslam
