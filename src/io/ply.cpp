#include "io/ply.hpp"

#include <array>
#include <bit>
#include <cstring>

#include "io/piece_file.hpp"

namespace ygslam {
namespace {

static_assert(std::endian::native == std::endian::little,
              "points are copied as they lie in memory");

constexpr std::size_t kPointBytes = 3 * sizeof(float) + 3;
constexpr std::string_view kMagic = "ply\nformat binary_little_endian 1.0\n";
constexpr std::string_view kProperties =
    "property float x\nproperty float y\nproperty float z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n";
constexpr std::string_view kEnd = "end_header\n";

std::array<char, kPointBytes> encode_point(const ColouredPoint& point) {
  CHECK(point.p_world.allFinite(), "a point that is not finite must not be written");
  std::array<char, kPointBytes> record;
  std::memcpy(record.data(), point.p_world.data(), 3 * sizeof(float));
  std::memcpy(record.data() + 12, &point.colour, 3);
  return record;
}

}  // namespace

std::string ply_header(std::span<const PlyElement> elements, std::string_view comments) {
  std::string header = std::string(kMagic).append(comments);
  for (const PlyElement& element : elements) {
    header.append("element ").append(element.name).append(" ");
    header.append(std::to_string(element.count)).append("\n").append(element.properties);
  }
  return header.append(kEnd);
}

Status write_ply(const std::filesystem::path& path, std::span<const ColouredPoint> points) {
  auto file = PieceFile::create(path);
  if (!file.ok()) return file.error();
  file->add(ply_header(std::array{PlyElement{"vertex", points.size(), kProperties}}));
  for (const ColouredPoint& point : points) file->add_value(encode_point(point));
  return file->commit();
}

}  // namespace ygslam
