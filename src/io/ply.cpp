#include "io/ply.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>

#include "io/atomic_file.hpp"
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
constexpr std::string_view kLabelProperty = "property ushort label\n";
constexpr std::string_view kEnd = "end_header\n";

std::string make_header(std::size_t count, const PlyOptions& options) {
  std::string header(kMagic);
  if (!options.comment.empty()) header += "comment " + printable(options.comment) + "\n";
  header += "element vertex " + std::to_string(count) + "\n" + std::string(kProperties);
  if (options.with_label) header += kLabelProperty;
  return header += kEnd;
}

void append_points(std::span<const CloudPoint> points, bool with_label, std::string& bytes) {
  for (const CloudPoint& point : points) {
    CHECK(point.p_world.allFinite(), "a point that is not finite must not be written");
    std::array<char, kPointBytes + sizeof(std::uint16_t)> record;
    std::memcpy(record.data(), point.p_world.data(), 3 * sizeof(float));
    std::memcpy(record.data() + 12, &point.colour, 3);
    std::memcpy(record.data() + 15, &point.label, sizeof point.label);
    bytes.append(record.data(), with_label ? record.size() : kPointBytes);
  }
}

struct Header {
  std::size_t count = 0;
  bool with_label = false;
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
  header.with_label = properties == std::string(kProperties) + std::string(kLabelProperty);
  if (!counted || (!header.with_label && properties != kProperties)) {
    return "other properties than x y z red green blue [label]";
  }
  return {};
}

}  // namespace

std::string encode_ply(std::span<const CloudPoint> points, const PlyOptions& options) {
  std::string bytes = make_header(points.size(), options);
  append_points(points, options.with_label, bytes);
  return bytes;
}

Status write_ply(const std::filesystem::path& path, std::span<const CloudPoint> points,
                 const PlyOptions& options) {
  constexpr std::size_t kPiece = 1 << 16;  // points; about 1 MB in memory at a time
  auto file = AtomicFile::create(path);
  if (!file.ok()) return file.error();
  std::string bytes = make_header(points.size(), options);
  for (std::size_t i = 0; i < points.size(); i += kPiece) {
    append_points(points.subspan(i, std::min(kPiece, points.size() - i)), options.with_label,
                  bytes);
    if (Status written = file->write(bytes); !written.ok()) return written;
    bytes.clear();
  }
  if (Status written = file->write(bytes); !written.ok()) return written;
  return file->commit();
}

Result<std::vector<CloudPoint>> parse_ply(std::string_view bytes, const std::string& name) {
  const auto fault = [&](const std::string& what) {
    return Error{ErrorKind::kInput, name + ": " + what};
  };
  Header header;
  const std::string wrong = parse_header(bytes, header);
  if (!wrong.empty()) return fault(wrong);
  bytes.remove_prefix(header.bytes);
  const std::size_t stride = kPointBytes + (header.with_label ? sizeof(std::uint16_t) : 0);
  if (bytes.size() / stride < header.count) return fault("truncated PLY file");
  if (bytes.size() != header.count * stride) return fault("more bytes than points");
  std::vector<CloudPoint> points(header.count);
  for (CloudPoint& point : points) {
    std::memcpy(point.p_world.data(), bytes.data(), 3 * sizeof(float));
    std::memcpy(&point.colour, bytes.data() + 12, 3);
    if (header.with_label) std::memcpy(&point.label, bytes.data() + 15, sizeof point.label);
    if (!point.p_world.allFinite()) return fault("a coordinate is not finite");
    bytes.remove_prefix(stride);
  }
  return points;
}

Result<std::vector<CloudPoint>> read_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path, std::size_t{4} << 30);
  if (!bytes.ok()) return bytes.error();
  return parse_ply(*bytes, path.string());
}

}  // namespace ygslam
