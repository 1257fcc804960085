#include "io/ply.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>

#include "io/piece_file.hpp"
#include "io/text.hpp"

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

std::string make_header(std::size_t count) {
  return ply_header(std::array{PlyElement{"vertex", count, kProperties}});
}

std::array<char, kPointBytes> encode_point(const ColouredPoint& point) {
  CHECK(point.p_world.allFinite(), "a point that is not finite must not be written");
  std::array<char, kPointBytes> record;
  std::memcpy(record.data(), point.p_world.data(), 3 * sizeof(float));
  std::memcpy(record.data() + 12, &point.colour, 3);
  return record;
}

struct Header {
  std::size_t count = 0;
  std::size_t bytes = 0;
};

// Our own header, comments allowed anywhere. @return the fault, empty if none.
std::string parse_header(std::string_view bytes, Header& header) {
  constexpr std::size_t kLongestHeader = 64 << 10;
  const std::size_t end = bytes.substr(0, kLongestHeader).find(kEnd);
  if (!bytes.starts_with(kMagic) || end == std::string_view::npos) {
    return "not a binary little-endian PLY file";
  }
  header.bytes = end + kEnd.size();
  std::string properties;
  bool counted = false;
  for (std::string_view rest = bytes.substr(kMagic.size(), end - kMagic.size()); !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    if (line.starts_with("comment ")) continue;
    if (line.starts_with("element vertex ") && !counted) {
      const std::string_view number = line.substr(15);
      const auto [last, error] =
          std::from_chars(number.data(), number.data() + number.size(), header.count);
      if (error != std::errc{} || last != number.data() + number.size()) return "bad vertex count";
      counted = true;
      continue;
    }
    properties += std::string(line) + "\n";
  }
  if (!counted || properties != kProperties) return "other properties than x y z red green blue";
  return {};
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

std::string encode_ply(std::span<const ColouredPoint> points) {
  std::string bytes = make_header(points.size());
  for (const ColouredPoint& point : points) {
    const auto record = encode_point(point);
    bytes.append(record.data(), record.size());
  }
  return bytes;
}

Status write_ply(const std::filesystem::path& path, std::span<const ColouredPoint> points) {
  auto file = PieceFile::create(path);
  if (!file.ok()) return file.error();
  file->add(make_header(points.size()));
  for (const ColouredPoint& point : points) file->add_value(encode_point(point));
  return file->commit();
}

Result<std::vector<ColouredPoint>> parse_ply(std::string_view bytes, const std::string& name) {
  const auto fault = [&](const std::string& what) {
    return Error{ErrorKind::kInput, name + ": " + what};
  };
  Header header;
  const std::string wrong = parse_header(bytes, header);
  if (!wrong.empty()) return fault(wrong);
  bytes.remove_prefix(header.bytes);
  if (bytes.size() / kPointBytes < header.count) return fault("truncated PLY file");
  if (bytes.size() != header.count * kPointBytes) return fault("more bytes than points");
  std::vector<ColouredPoint> points(header.count);
  for (ColouredPoint& point : points) {
    std::memcpy(point.p_world.data(), bytes.data(), 3 * sizeof(float));
    std::memcpy(&point.colour, bytes.data() + 12, 3);
    if (!point.p_world.allFinite()) return fault("a coordinate is not finite");
    bytes.remove_prefix(kPointBytes);
  }
  return points;
}

Result<std::vector<ColouredPoint>> read_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path, std::size_t{4} << 30);
  if (!bytes.ok()) return bytes.error();
  return parse_ply(*bytes, path.string());
}

}  // namespace ygslam
