#include "scene_file/labelled_cloud.hpp"

#include <array>
#include <bitset>
#include <limits>

#include "io/piece_file.hpp"
#include "io/ply.hpp"

namespace ygslam {
namespace {

// "uint16", not its other name "ushort": Open3D leaves out what is called so.
constexpr std::string_view kPointProperties =
    "property float x\nproperty float y\nproperty float z\n"
    "property float nx\nproperty float ny\nproperty float nz\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    "property uint16 label\nproperty uint16 instance\nproperty float prob\n";
constexpr std::string_view kFaceProperties = "property list uchar int vertex_indices\n";

std::string class_comments(std::span<const SurfacePoint> points) {
  std::bitset<256> seen;
  for (const SurfacePoint& point : points)
    seen.set(static_cast<std::size_t>(point.label.semantic_class));
  std::string comments;
  for (std::size_t id = 0; id < seen.size(); ++id) {
    if (!seen[id]) continue;
    comments += "comment label " + std::to_string(id) + " " +
                semantic_class_name(static_cast<SemanticClass>(id)) + "\n";
  }
  return comments;
}

void add_points(PieceFile& file, std::span<const SurfacePoint> points) {
  for (const SurfacePoint& point : points) {
    CHECK(point.p_world.allFinite() && point.normal_world.allFinite() &&
              std::isfinite(point.label.probability),
          "a point that is not finite must not be written");
    for (int i = 0; i < 3; ++i) file.add_value(point.p_world[i]);
    for (int i = 0; i < 3; ++i) file.add_value(point.normal_world[i]);
    file.add_value(point.colour);
    file.add_value(static_cast<std::uint16_t>(point.label.semantic_class));
    file.add_value(static_cast<std::uint16_t>(point.label.object));
    file.add_value(point.label.probability);
  }
}

}  // namespace

Status write_labelled_ply(const std::filesystem::path& path, std::span<const SurfacePoint> points) {
  auto file = PieceFile::create(path);
  if (!file.ok()) return file.error();
  const PlyElement vertices{"vertex", points.size(), kPointProperties};
  file->add(ply_header(std::array{vertices}, class_comments(points)));
  add_points(*file, points);
  return file->commit();
}

Status write_mesh_ply(const std::filesystem::path& path, const TriangleMesh& mesh) {
  if (mesh.vertices.size() > std::numeric_limits<std::int32_t>::max()) {
    return Error{ErrorKind::kOutput, path.string() + ": more vertices than a PLY file can number"};
  }
  auto file = PieceFile::create(path);
  if (!file.ok()) return file.error();
  const PlyElement vertices{"vertex", mesh.vertices.size(), kPointProperties};
  const PlyElement faces{"face", mesh.triangles.size(), kFaceProperties};
  file->add(ply_header(std::array{vertices, faces}, class_comments(mesh.vertices)));
  add_points(*file, mesh.vertices);
  for (const auto& triangle : mesh.triangles) {
    file->add_value(std::uint8_t{3});
    for (const std::uint32_t vertex : triangle) {
      CHECK(vertex < mesh.vertices.size(), "a triangle without its vertex");
      file->add_value(vertex);
    }
  }
  return file->commit();
}

Status write_pcd(const std::filesystem::path& path, std::span<const SurfacePoint> points) {
  auto file = PieceFile::create(path);
  if (!file.ok()) return file.error();
  const std::string count = std::to_string(points.size());
  file->add(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb label\n"
      "SIZE 4 4 4 4 4\nTYPE F F F F U\nCOUNT 1 1 1 1 1\nWIDTH " +
      count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA binary\n");
  for (const SurfacePoint& point : points) {
    CHECK(point.p_world.allFinite(), "a point that is not finite must not be written");
    for (int i = 0; i < 3; ++i) file->add_value(point.p_world[i]);
    const Rgb8 colour = point.colour;
    file->add_value(std::array<std::uint8_t, 4>{colour.b, colour.g, colour.r, 0});
    file->add_value(static_cast<std::uint32_t>(point.label.semantic_class));
  }
  return file->commit();
}

}  // namespace ygslam
