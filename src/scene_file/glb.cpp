#include "scene_file/glb.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "io/piece_file.hpp"
#include "scene_file/objects_file.hpp"

namespace ygslam {
namespace {

using Json = nlohmann::ordered_json;

// Every field begins at a multiple of four bytes, as glTF 2.0, section 3.6.2.4, demands.
struct GlbVertex {
  std::array<float, 3> position, normal;
  std::array<std::uint16_t, 4> colour;
  std::uint16_t class_id, class_pad;
  std::uint16_t instance, instance_pad;
  float probability;
};
static_assert(sizeof(GlbVertex) == 44);

constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;

struct Attribute {
  const char* name;
  const char* type;
  int component;
  std::size_t offset;
};
constexpr std::array<Attribute, 6> kAttributes{
    {{"POSITION", "VEC3", kFloat, offsetof(GlbVertex, position)},
     {"NORMAL", "VEC3", kFloat, offsetof(GlbVertex, normal)},
     {"COLOR_0", "VEC4", kUnsignedShort, offsetof(GlbVertex, colour)},
     {"_CLASS", "SCALAR", kUnsignedShort, offsetof(GlbVertex, class_id)},
     {"_INSTANCE", "SCALAR", kUnsignedShort, offsetof(GlbVertex, instance)},
     {"_PROBABILITY", "SCALAR", kFloat, offsetof(GlbVertex, probability)}}};

// Of sRGB, IEC 61966-2-1.
std::uint16_t linear_light(std::uint8_t value) {
  const double c = value / 255.0;
  const double light = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(light * 65535));
}

std::array<std::uint16_t, 256> linear_light_table() {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t i = 0; i < 256; ++i) table[i] = linear_light(static_cast<std::uint8_t>(i));
  return table;
}

GlbVertex glb_vertex(const SurfacePoint& point, const Eigen::Vector3f& up) {
  static const auto kLinearLight = linear_light_table();
  CHECK(point.p_world.allFinite() && point.normal_world.allFinite() &&
            std::isfinite(point.label.probability),
        "a vertex that is not finite must not be written");
  const float length = point.normal_world.norm();
  const Eigen::Vector3f normal = length > 0.1F ? Eigen::Vector3f(point.normal_world / length) : up;
  const auto light = [&](std::uint8_t value) { return kLinearLight[value]; };
  return {{point.p_world.x(), point.p_world.y(), point.p_world.z()},
          {normal.x(), normal.y(), normal.z()},
          {light(point.colour.r), light(point.colour.g), light(point.colour.b), 65535},
          static_cast<std::uint16_t>(point.label.semantic_class),
          0,
          static_cast<std::uint16_t>(point.label.object),
          0,
          point.label.probability};
}

// What one node shows: a part of `vertices` and, counted from its first one, of `indices`.
struct Part {
  std::size_t first_vertex = 0, vertices = 0, first_index = 0, indices = 0;
  Eigen::Vector3f min = Eigen::Vector3f::Zero(), max = Eigen::Vector3f::Zero();
};

struct Parts {
  std::vector<Part> parts;  // background, then the objects
  std::vector<std::uint32_t> vertices;
  std::vector<std::uint32_t> indices;
};

std::vector<std::uint32_t> triangles_by_part(const TriangleMesh& mesh,
                                             std::span<const SceneObject> objects,
                                             std::vector<Part>& parts) {
  std::vector<std::uint16_t> part_of(std::numeric_limits<std::uint16_t>::max() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    CHECK(objects[i].id != kNoSceneObject && part_of[static_cast<std::size_t>(objects[i].id)] == 0,
          "each object once, with a number");
    part_of[static_cast<std::size_t>(objects[i].id)] = static_cast<std::uint16_t>(i + 1);
  }
  const auto part_of_triangle = [&](const std::array<std::uint32_t, 3>& triangle) {
    std::array<std::uint16_t, 3> corner{};
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(triangle[i] < mesh.vertices.size(), "a triangle without its vertex");
      corner[i] = part_of[static_cast<std::size_t>(mesh.vertices[triangle[i]].label.object)];
    }
    return corner[1] == corner[2] ? corner[1] : corner[0];
  };
  parts.resize(objects.size() + 1);
  for (const auto& triangle : mesh.triangles) parts[part_of_triangle(triangle)].indices += 3;
  std::vector<std::size_t> next(parts.size());
  for (std::size_t i = 1; i < parts.size(); ++i) {
    parts[i].first_index = parts[i - 1].first_index + parts[i - 1].indices;
    next[i] = parts[i].first_index / 3;
  }
  std::vector<std::uint32_t> order(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    order[next[part_of_triangle(mesh.triangles[i])]++] = i;
  return order;
}

// A vertex that two parts share is in both.
Parts split_by_object(const TriangleMesh& mesh, std::span<const SceneObject> objects) {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  Parts split;
  const auto order = triangles_by_part(mesh, objects, split.parts);
  split.indices.reserve(order.size() * 3);
  std::vector<std::uint32_t> local(mesh.vertices.size(), kNone);
  for (Part& part : split.parts) {
    part.first_vertex = split.vertices.size();
    for (std::size_t i = part.first_index; i < part.first_index + part.indices; ++i) {
      const std::uint32_t vertex = mesh.triangles[order[i / 3]][i % 3];
      const Eigen::Vector3f& p_world = mesh.vertices[vertex].p_world;
      if (local[vertex] == kNone) {
        local[vertex] = static_cast<std::uint32_t>(split.vertices.size() - part.first_vertex);
        part.min = local[vertex] == 0 ? p_world : Eigen::Vector3f(part.min.cwiseMin(p_world));
        part.max = local[vertex] == 0 ? p_world : Eigen::Vector3f(part.max.cwiseMax(p_world));
        split.vertices.push_back(vertex);
      }
      split.indices.push_back(local[vertex]);
    }
    part.vertices = split.vertices.size() - part.first_vertex;
    for (std::size_t i = part.first_vertex; i < split.vertices.size(); ++i)
      local[split.vertices[i]] = kNone;
  }
  return split;
}

Json corner_json(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

// The accessors of one part; @return its primitive.
Json add_accessors(const Part& part, Json& accessors) {
  Json attributes = Json::object();
  for (const Attribute& attribute : kAttributes) {
    attributes[attribute.name] = accessors.size();
    Json accessor = {{"bufferView", 0},
                     {"byteOffset", part.first_vertex * sizeof(GlbVertex) + attribute.offset},
                     {"componentType", attribute.component},
                     {"count", part.vertices},
                     {"type", attribute.type}};
    if (attribute.name == std::string_view("COLOR_0")) accessor["normalized"] = true;
    if (attribute.name == std::string_view("POSITION")) {
      accessor["min"] = corner_json(part.min);
      accessor["max"] = corner_json(part.max);
    }
    accessors.push_back(std::move(accessor));
  }
  Json primitive = {{"attributes", attributes}, {"indices", accessors.size()}, {"material", 0}};
  accessors.push_back({{"bufferView", 1},
                       {"byteOffset", part.first_index * sizeof(std::uint32_t)},
                       {"componentType", kUnsignedInt},
                       {"count", part.indices},
                       {"type", "SCALAR"}});
  return primitive;
}

// glTF knows no empty lists: what is empty is left out.
Json make_document(const Parts& split, std::span<const SceneObject> objects,
                   const Gravity& gravity) {
  const auto to_y_up = Eigen::Quaterniond::FromTwoVectors(gravity.up_world, Vec3::UnitY());
  Json nodes = Json::array();
  nodes.push_back({{"name", "scene"},
                   {"rotation", {to_y_up.x(), to_y_up.y(), to_y_up.z(), to_y_up.w()}},
                   {"children", Json::array()}});
  Json meshes = Json::array();
  Json accessors = Json::array();
  for (std::size_t i = 0; i < split.parts.size(); ++i) {
    Json node = {{"name", i == 0 ? "background" : object_name(objects[i - 1])}};
    if (split.parts[i].indices > 0) {
      node["mesh"] = meshes.size();
      const Json primitive = add_accessors(split.parts[i], accessors);
      meshes.push_back({{"name", node["name"]}, {"primitives", Json::array({primitive})}});
    }
    if (i > 0) node["extras"] = object_json(objects[i - 1], gravity);
    nodes[0]["children"].push_back(nodes.size());
    nodes.push_back(std::move(node));
  }
  Json document = {{"asset", {{"version", "2.0"}, {"generator", "YG-SLAM"}}},
                   {"scene", 0},
                   {"scenes", Json::array({{{"nodes", Json::array({0})}}})},
                   {"nodes", nodes}};
  if (split.indices.empty()) return document;
  const std::size_t vertex_bytes = split.vertices.size() * sizeof(GlbVertex);
  const std::size_t index_bytes = split.indices.size() * sizeof(std::uint32_t);
  document["meshes"] = meshes;
  document["materials"] =
      Json::array({{{"doubleSided", true},
                    {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}}}});
  document["accessors"] = accessors;
  document["bufferViews"] = Json::array({{{"buffer", 0},
                                          {"byteLength", vertex_bytes},
                                          {"byteStride", sizeof(GlbVertex)},
                                          {"target", kArrayBuffer}},
                                         {{"buffer", 0},
                                          {"byteOffset", vertex_bytes},
                                          {"byteLength", index_bytes},
                                          {"target", kElementArrayBuffer}}});
  document["buffers"] = Json::array({{{"byteLength", vertex_bytes + index_bytes}}});
  return document;
}

}  // namespace

Status write_glb(const std::filesystem::path& path, const TriangleMesh& mesh,
                 std::span<const SceneObject> objects, const Gravity& gravity) {
  const Parts split = split_by_object(mesh, objects);
  std::string json = make_document(split, objects, gravity).dump();
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::size_t binary = split.vertices.size() * sizeof(GlbVertex) + split.indices.size() * 4;
  const std::size_t total = 12 + 8 + json.size() + (binary > 0 ? 8 + binary : 0);
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    return Error{ErrorKind::kOutput, path.string() + ": more than the 4 GiB that GLB can hold"};
  }
  auto file = PieceFile::create(path);
  if (!file.ok()) return file.error();
  const auto add_chunk_head = [&](std::size_t bytes, std::string_view type) {
    file->add_value(static_cast<std::uint32_t>(bytes));
    file->add(type);
  };
  file->add("glTF");
  file->add_value(std::uint32_t{2});
  file->add_value(static_cast<std::uint32_t>(total));
  add_chunk_head(json.size(), "JSON");
  file->add(json);
  if (binary > 0) {
    add_chunk_head(binary, std::string_view("BIN\0", 4));
    const Eigen::Vector3f up = gravity.up_world.normalized().cast<float>();
    for (const std::uint32_t i : split.vertices) file->add_value(glb_vertex(mesh.vertices[i], up));
    for (const std::uint32_t index : split.indices) file->add_value(index);
  }
  return file->commit();
}

}  // namespace ygslam
