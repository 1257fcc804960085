#include "scene_file/read_surface.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <sstream>

#include "io/text.hpp"

namespace ygslam {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie");

enum class Kind { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

std::optional<Kind> kind_of(std::string_view name) {
  constexpr std::array<std::array<std::string_view, 2>, 8> kNames{{{"char", "int8"},
                                                                   {"uchar", "uint8"},
                                                                   {"short", "int16"},
                                                                   {"ushort", "uint16"},
                                                                   {"int", "int32"},
                                                                   {"uint", "uint32"},
                                                                   {"float", "float32"},
                                                                   {"double", "float64"}}};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (name == kNames[i][0] || name == kNames[i][1]) return static_cast<Kind>(i);
  return {};
}

std::size_t size_of(Kind kind) {
  constexpr std::array<std::size_t, 8> kBytes{1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(kind)];
}

template <typename T>
double load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double load(Kind kind, const char* at) {
  switch (kind) {
    case Kind::kI8:
      return load<std::int8_t>(at);
    case Kind::kU8:
      return load<std::uint8_t>(at);
    case Kind::kI16:
      return load<std::int16_t>(at);
    case Kind::kU16:
      return load<std::uint16_t>(at);
    case Kind::kI32:
      return load<std::int32_t>(at);
    case Kind::kU32:
      return load<std::uint32_t>(at);
    case Kind::kF32:
      return load<float>(at);
    case Kind::kF64:
      return load<double>(at);
  }
  return 0;
}

struct Property {
  std::string name;
  Kind kind = Kind::kF32;
  std::optional<Kind> count;  // of a list
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Fault {
  std::string what;
};

[[noreturn]] void fail(const std::string& what) { throw Fault{what}; }

void add_property(std::istringstream& words, std::vector<Element>& elements) {
  Property property;
  std::string type, count;
  words >> type;
  if (type == "list") {
    words >> count >> type;
    property.count = kind_of(count);
    if (!property.count) fail("header: unknown type \"" + count + "\"");
  }
  const auto kind = kind_of(type);
  if (!kind || elements.empty() || !(words >> property.name))
    fail("header: a property that is none");
  property.kind = *kind;
  elements.back().properties.push_back(std::move(property));
}

// Moves `bytes` on to the data.
std::vector<Element> take_header(std::string_view& bytes) {
  constexpr std::size_t kLongestHeader = 64 << 10;
  constexpr std::string_view kEnd = "end_header\n";
  const std::size_t end = bytes.substr(0, kLongestHeader).find(kEnd);
  if (!bytes.starts_with("ply\n") || end == std::string_view::npos) fail("not a PLY file");
  std::istringstream lines{std::string(bytes.substr(4, end - 4))};
  bytes.remove_prefix(end + kEnd.size());
  std::vector<Element> elements;
  bool is_binary = false;
  for (std::string line, word; std::getline(lines, line);) {
    std::istringstream words(line);
    words >> word;
    if (word == "format") {
      words >> word;
      is_binary = word == "binary_little_endian";
    } else if (word == "property") {
      add_property(words, elements);
    } else if (word == "element") {
      Element element;
      std::string number;
      words >> element.name >> number;
      const char* last = number.data() + number.size();
      const auto [to, error] = std::from_chars(number.data(), last, element.count);
      if (error != std::errc{} || to != last || number.empty())
        fail("header: a count that is none");
      elements.push_back(std::move(element));
    }
  }
  if (!is_binary) fail("not a binary little-endian PLY file");
  return elements;
}

constexpr const char* kTruncated = "truncated PLY file";

// A row's part that is to be taken, and where it goes.
struct Field {
  Kind kind;
  std::size_t offset;
  void (*put)(SurfacePoint&, double);
};

float float_of(double value) {
  constexpr double kMost = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kMost, kMost));
}

std::uint8_t byte_of(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
}

constexpr std::array<std::pair<std::string_view, void (*)(SurfacePoint&, double)>, 12> kFields{
    {{"x", [](SurfacePoint& p, double v) { p.p_world.x() = float_of(v); }},
     {"y", [](SurfacePoint& p, double v) { p.p_world.y() = float_of(v); }},
     {"z", [](SurfacePoint& p, double v) { p.p_world.z() = float_of(v); }},
     {"nx", [](SurfacePoint& p, double v) { p.normal_world.x() = float_of(v); }},
     {"ny", [](SurfacePoint& p, double v) { p.normal_world.y() = float_of(v); }},
     {"nz", [](SurfacePoint& p, double v) { p.normal_world.z() = float_of(v); }},
     {"red", [](SurfacePoint& p, double v) { p.colour.r = byte_of(v); }},
     {"green", [](SurfacePoint& p, double v) { p.colour.g = byte_of(v); }},
     {"blue", [](SurfacePoint& p, double v) { p.colour.b = byte_of(v); }},
     {"label", [](SurfacePoint& p,
                  double v) { p.label.semantic_class = static_cast<SemanticClass>(byte_of(v)); }},
     {"instance",
      [](SurfacePoint& p, double v) {
        p.label.object =
            static_cast<SceneObjectId>(static_cast<std::uint16_t>(std::clamp(v, 0.0, 65535.0)));
      }},
     {"prob", [](SurfacePoint& p, double v) { p.label.probability = float_of(v); }}}};

// Where squares and products of coordinates still are numbers.
void check(const SurfacePoint& point) {
  constexpr float kMostDistant_m = 1e9F;
  if (point.p_world.lpNorm<Eigen::Infinity>() > kMostDistant_m ||
      point.normal_world.lpNorm<Eigen::Infinity>() > kMostDistant_m)
    fail("a point beyond 10^9 m");
}

std::vector<SurfacePoint> take_points(const Element& element, std::string_view& bytes) {
  std::size_t stride = 0;
  std::vector<Field> fields;
  for (const Property& property : element.properties) {
    if (property.count) fail("a vertex with a list");
    for (const auto& [name, put] : kFields)
      if (name == property.name) fields.push_back({property.kind, stride, put});
    stride += size_of(property.kind);
  }
  for (const std::string_view axis : {"x", "y", "z"}) {
    if (std::none_of(element.properties.begin(), element.properties.end(),
                     [&](const Property& p) { return p.name == axis; }))
      fail("vertices without x, y and z");
  }
  if (bytes.size() / stride < element.count) fail(kTruncated);
  std::vector<SurfacePoint> points(element.count);
  for (SurfacePoint& point : points) {
    for (const Field& field : fields) {
      const double value = load(field.kind, bytes.data() + field.offset);
      if (!std::isfinite(value)) fail("a number that is not finite");
      field.put(point, value);
    }
    check(point);
    bytes.remove_prefix(stride);
  }
  return points;
}

double take(Kind kind, std::string_view& bytes) {
  if (bytes.size() < size_of(kind)) fail(kTruncated);
  const double value = load(kind, bytes.data());
  bytes.remove_prefix(size_of(kind));
  return value;
}

void add_fan(const std::vector<double>& corners, std::size_t vertices,
             std::vector<std::array<std::uint32_t, 3>>& triangles) {
  for (const double corner : corners)
    if (!(corner >= 0 && corner < static_cast<double>(vertices))) fail("a face without its vertex");
  const auto index = [&](std::size_t i) { return static_cast<std::uint32_t>(corners[i]); };
  for (std::size_t i = 2; i < corners.size(); ++i)
    triangles.push_back({index(0), index(i - 1), index(i)});
}

void take_faces(const Element& element, std::string_view& bytes, TriangleMesh& mesh) {
  if (element.properties.empty()) fail("faces without vertices");
  std::vector<double> values;
  for (std::size_t row = 0; row < element.count; ++row) {
    for (const Property& property : element.properties) {
      const double count = property.count ? take(*property.count, bytes) : 1;
      if (!(count >= 0 && count <= static_cast<double>(bytes.size()))) fail(kTruncated);
      values.clear();
      for (double i = 0; i < count; ++i) values.push_back(take(property.kind, bytes));
      if (property.count && property.name.starts_with("vertex_ind"))
        add_fan(values, mesh.vertices.size(), mesh.triangles);
    }
  }
}

}  // namespace

Result<TriangleMesh> parse_surface_ply(std::string_view bytes, const std::string& name) {
  try {
    TriangleMesh mesh;
    bool has_points = false;
    for (const Element& element : take_header(bytes)) {
      if (element.name == "vertex" && !has_points) {
        mesh.vertices = take_points(element, bytes);
        has_points = true;
      } else if (element.name == "face" && has_points) {
        take_faces(element, bytes, mesh);
      } else {
        fail("neither vertices nor faces: \"" + element.name + "\"");
      }
    }
    if (!has_points) fail("no vertices");
    if (!bytes.empty()) fail("more bytes than the header says");
    return mesh;
  } catch (const Fault& fault) {
    return Error{ErrorKind::kInput, name + ": " + fault.what};
  }
}

Result<TriangleMesh> read_surface_ply(const std::filesystem::path& path) {
  const auto bytes = read_file(path, std::size_t{4} << 30);
  if (!bytes.ok()) return bytes.error();
  return parse_surface_ply(*bytes, path.string());
}

}  // namespace ygslam
