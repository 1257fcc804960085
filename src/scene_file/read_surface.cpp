#include "scene_file/read_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/log.hpp"
#include "io/text.hpp"
#include "scene_file/ply_numbers.hpp"

namespace ygslam {
namespace {

using ply::Element;
using ply::fail;
using ply::Fault;
using ply::Kind;
using ply::Numbers;
using ply::Property;

// Where a number goes.
using Put = void (*)(SurfacePoint&, double);

float float_of(double value) {
  constexpr double kMost = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(value, -kMost, kMost));
}

std::uint8_t byte_of(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
}

constexpr std::array<std::pair<std::string_view, Put>, 9> kFields{
    {{"x", [](SurfacePoint& p, double v) { p.p_world.x() = float_of(v); }},
     {"y", [](SurfacePoint& p, double v) { p.p_world.y() = float_of(v); }},
     {"z", [](SurfacePoint& p, double v) { p.p_world.z() = float_of(v); }},
     {"nx", [](SurfacePoint& p, double v) { p.normal_world.x() = float_of(v); }},
     {"ny", [](SurfacePoint& p, double v) { p.normal_world.y() = float_of(v); }},
     {"nz", [](SurfacePoint& p, double v) { p.normal_world.z() = float_of(v); }},
     {"label", [](SurfacePoint& p,
                  double v) { p.label.semantic_class = static_cast<SemanticClass>(byte_of(v)); }},
     {"instance",
      [](SurfacePoint& p, double v) {
        p.label.object =
            static_cast<SceneObjectId>(static_cast<std::uint16_t>(std::clamp(v, 0.0, 65535.0)));
      }},
     {"prob", [](SurfacePoint& p, double v) { p.label.probability = float_of(v); }}}};

/// The colours of all points: bytes, or parts of 1, or of 65535, which their type and the largest
/// of them tell.
class Colours {
 public:
  explicit Colours(const Element& element) {
    constexpr std::array<std::array<std::string_view, 3>, 3> kNames{
        {{"red", "diffuse_red", "r"},
         {"green", "diffuse_green", "g"},
         {"blue", "diffuse_blue", "b"}}};
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      for (std::size_t c = 0; c < kNames.size(); ++c)
        if (!property.count && std::ranges::count(kNames[c], property.name) > 0) {
          column_[c] = i;
          kind_ = property.kind;
        }
    }
  }
  [[nodiscard]] bool are_there() const { return std::ranges::count(column_, kNone) == 0; }
  [[nodiscard]] bool has(std::size_t column) const {
    return std::ranges::count(column_, column) > 0;
  }
  void take(std::size_t column, double value) {
    values_.push_back(static_cast<float>(std::clamp(value, 0.0, 65535.0)));
    largest_ = std::max(largest_, values_.back());
    place_[static_cast<std::size_t>(std::ranges::find(column_, column) - column_.begin())] =
        (values_.size() - 1) % column_.size();
  }
  [[nodiscard]] bool are_parts_of_one() const {
    return (kind_ == Kind::kF32 || kind_ == Kind::kF64) && largest_ <= 1;
  }
  void put(std::vector<SurfacePoint>& points) const {
    if (!are_there()) return;
    const float factor = are_parts_of_one()                         ? 255.0F
                         : kind_ == Kind::kU16 && largest_ > 255.0F ? 1.0F / 257.0F
                                                                    : 1.0F;
    const float half = factor == 1.0F ? 0.0F : 0.5F;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto byte = [&](std::size_t c) {
        return byte_of(values_[3 * i + place_[c]] * factor + half);
      };
      points[i].colour = {byte(0), byte(1), byte(2)};
    }
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::array<std::size_t, 3> column_{kNone, kNone, kNone};  // of red, green, blue
  std::array<std::size_t, 3> place_{};                      // among the three values of a point
  Kind kind_ = Kind::kU8;
  std::vector<float> values_;
  float largest_ = 0;
};

// Where squares and products of coordinates still are numbers.
void check(const SurfacePoint& point) {
  constexpr float kMostDistant_m = 1e9F;
  if (point.p_world.lpNorm<Eigen::Infinity>() > kMostDistant_m ||
      point.normal_world.lpNorm<Eigen::Infinity>() > kMostDistant_m)
    fail("a point beyond 10^9 m");
}

Put field_of(const Property& property) {
  for (const auto& [name, put] : kFields)
    if (!property.count && name == property.name) return put;
  return nullptr;
}

/// What a file was taken for, of what is not as our own are.
struct Notes {
  std::string text;
  void add(const std::string& what) { text += (text.empty() ? "" : ", ") + what; }
};

std::vector<SurfacePoint> take_points(const Element& element, Numbers& numbers, Notes& notes) {
  constexpr Rgb8 kGrey = {160, 160, 160};  // of points without colours
  std::vector<Put> fields;
  for (const Property& property : element.properties) fields.push_back(field_of(property));
  for (const std::string_view axis : {"x", "y", "z"})
    if (std::ranges::none_of(element.properties,
                             [&](const Property& p) { return p.name == axis && !p.count; }))
      fail("vertices without x, y and z");
  Colours colours(element);
  numbers.expect_rows(element);
  SurfacePoint blank;
  blank.colour = kGrey;
  std::vector<SurfacePoint> points(element.count, blank);
  for (SurfacePoint& point : points) {
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (element.properties[i].count) {
        numbers.skip(element.properties[i]);
        continue;
      }
      const double value = numbers.take(element.properties[i].kind);
      const bool is_colour = colours.has(i);
      if ((is_colour || fields[i] != nullptr) && !std::isfinite(value))
        fail("a number that is not finite");
      if (fields[i] != nullptr) fields[i](point, value);
      if (is_colour && colours.are_there()) colours.take(i, value);
    }
    check(point);
  }
  colours.put(points);
  if (!colours.are_there()) notes.add("no colours: grey");
  if (colours.are_there() && colours.are_parts_of_one() && !points.empty())
    notes.add("colours from 0 to 1");
  return points;
}

void add_fan(const std::vector<double>& corners,
             std::vector<std::array<std::uint32_t, 3>>& triangles) {
  constexpr double kMostVertices = std::numeric_limits<std::uint32_t>::max();
  for (const double corner : corners)
    if (!(corner >= 0 && corner < kMostVertices)) fail("a face without its vertex");
  const auto index = [&](std::size_t i) { return static_cast<std::uint32_t>(corners[i]); };
  for (std::size_t i = 2; i < corners.size(); ++i)
    triangles.push_back({index(0), index(i - 1), index(i)});
}

void take_faces(const Element& element, Numbers& numbers, TriangleMesh& mesh) {
  if (element.properties.empty()) fail("faces without vertices");
  numbers.expect_rows(element);
  std::vector<double> values;
  for (std::size_t row = 0; row < element.count; ++row) {
    for (const Property& property : element.properties) {
      if (!property.count || !property.name.starts_with("vertex_ind")) {
        numbers.skip(property);
        continue;
      }
      values.clear();
      for (std::size_t n = numbers.take_count(*property.count); n > 0; --n)
        values.push_back(numbers.take(property.kind));
      add_fan(values, mesh.triangles);
    }
  }
}

void skip_rows(const Element& element, Numbers& numbers, Notes& notes) {
  if (element.count == 0 || element.properties.empty()) return;
  numbers.expect_rows(element);
  for (std::size_t row = 0; row < element.count; ++row)
    for (const Property& property : element.properties) numbers.skip(property);
  notes.add("element '" + printable(element.name, 24) + "' left out");
}

TriangleMesh take_mesh(std::string_view bytes, Notes& notes) {
  const ply::PlyHead head = ply::take_header(bytes);
  if (head.storage == ply::Storage::kText) notes.add("PLY as text");
  if (head.storage == ply::Storage::kBigEndian) notes.add("big-endian PLY");
  Numbers numbers(bytes, head.storage);
  TriangleMesh mesh;
  bool has_points = false;
  for (const Element& element : head.elements) {
    if (element.name == "vertex" && !has_points) {
      mesh.vertices = take_points(element, numbers, notes);
      has_points = true;
    } else if (element.name == "face") {
      take_faces(element, numbers, mesh);
    } else {
      skip_rows(element, numbers, notes);
    }
  }
  if (!has_points) fail("no vertices");
  if (!numbers.is_at_end()) fail("more bytes than the header says");
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle)
      if (corner >= mesh.vertices.size()) fail("a face without its vertex");
  return mesh;
}

}  // namespace

Result<TriangleMesh> parse_surface_ply(std::string_view bytes, const std::string& name) {
  try {
    Notes notes;
    TriangleMesh mesh = take_mesh(bytes, notes);
    if (!notes.text.empty()) log::info("{}: {}", name, notes.text);
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
