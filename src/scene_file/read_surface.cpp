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

#include "core/log.hpp"
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
double load(const char* at, bool swaps) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), at, sizeof(T));
  if (swaps) std::reverse(bytes.begin(), bytes.end());
  T value;
  std::memcpy(&value, bytes.data(), sizeof value);
  return static_cast<double>(value);
}

double load(Kind kind, const char* at, bool swaps) {
  switch (kind) {
    case Kind::kI8:
      return load<std::int8_t>(at, swaps);
    case Kind::kU8:
      return load<std::uint8_t>(at, swaps);
    case Kind::kI16:
      return load<std::int16_t>(at, swaps);
    case Kind::kU16:
      return load<std::uint16_t>(at, swaps);
    case Kind::kI32:
      return load<std::int32_t>(at, swaps);
    case Kind::kU32:
      return load<std::uint32_t>(at, swaps);
    case Kind::kF32:
      return load<float>(at, swaps);
    case Kind::kF64:
      return load<double>(at, swaps);
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

enum class Storage { kText, kLittleEndian, kBigEndian };

struct PlyHead {
  Storage storage = Storage::kText;
  std::vector<Element> elements;
};

Storage storage_of(const std::string& name) {
  if (name == "ascii") return Storage::kText;
  if (name == "binary_little_endian") return Storage::kLittleEndian;
  if (name == "binary_big_endian") return Storage::kBigEndian;
  fail("header: unknown format \"" + name + "\"");
}

void add_element(std::istringstream& words, std::vector<Element>& elements) {
  constexpr std::size_t kMostElements = 64;
  Element element;
  std::string number;
  words >> element.name >> number;
  const char* last = number.data() + number.size();
  const auto [to, error] = std::from_chars(number.data(), last, element.count);
  if (error != std::errc{} || to != last || number.empty()) fail("header: a count that is none");
  if (elements.size() >= kMostElements) fail("header: more than 64 elements");
  elements.push_back(std::move(element));
}

// Moves `bytes` on to the data. Lines may end in CR LF.
PlyHead take_header(std::string_view& bytes) {
  constexpr std::size_t kLongestHeader = 64 << 10;
  constexpr std::string_view kEnd = "\nend_header";
  const std::string_view start = bytes.substr(0, kLongestHeader);
  const std::size_t end = start.find(kEnd);
  const bool is_ply = bytes.starts_with("ply\n") || bytes.starts_with("ply\r\n");
  if (!is_ply || end == std::string_view::npos) fail("not a PLY file");
  std::size_t data_at = end + kEnd.size();
  if (start.substr(data_at).starts_with('\r')) ++data_at;
  if (!start.substr(data_at).starts_with('\n')) fail("not a PLY file");
  std::istringstream lines{std::string(bytes.substr(0, end))};
  bytes.remove_prefix(data_at + 1);
  PlyHead head;
  bool has_format = false;
  for (std::string line, word; std::getline(lines, line);) {
    std::istringstream words(line);  // to which CR is a blank
    words >> word;
    if (word == "format") {
      words >> word;
      head.storage = storage_of(word);
      has_format = true;
    } else if (word == "property") {
      add_property(words, head.elements);
    } else if (word == "element") {
      add_element(words, head.elements);
    }
  }
  if (!has_format) fail("header: no format");
  return head;
}

constexpr const char* kTruncated = "truncated PLY file";

/// The numbers behind the header, one after the other.
class Numbers {
 public:
  Numbers(std::string_view bytes, Storage storage) : rest_(bytes), storage_(storage) {}

  double take(Kind kind) {
    if (storage_ == Storage::kText) return take_word();
    if (rest_.size() < size_of(kind)) fail(kTruncated);
    const double value = load(kind, rest_.data(), storage_ == Storage::kBigEndian);
    rest_.remove_prefix(size_of(kind));
    return value;
  }
  /// Of a list, as many as can be there.
  std::size_t take_count(Kind kind) {
    const double count = take(kind);
    if (!(count >= 0 && count <= static_cast<double>(rest_.size()))) fail(kTruncated);
    return static_cast<std::size_t>(count);
  }
  void skip(const Property& property) {
    for (std::size_t n = property.count ? take_count(*property.count) : 1; n > 0; --n)
      take(property.kind);
  }
  /// Whether so many rows can be there, before anything is allocated for them.
  void expect_rows(const Element& element) const {
    std::size_t least = 0;  // of a row: in text a digit and a blank each
    for (const Property& property : element.properties)
      least += storage_ == Storage::kText ? 2 : size_of(property.count.value_or(property.kind));
    if (least > 0 && (rest_.size() + 1) / least < element.count) fail(kTruncated);
  }
  [[nodiscard]] bool is_at_end() {
    if (storage_ == Storage::kText) skip_blanks();
    return rest_.empty();
  }

 private:
  void skip_blanks() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
  }
  double take_word() {
    skip_blanks();
    if (rest_.empty()) fail(kTruncated);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n"));
    rest_.remove_prefix(word.size());
    if (const auto value = parse_number(word)) return *value;
    for (const std::string_view none : {"nan", "-nan", "NaN", "inf", "-inf"})
      if (word == none) return std::numeric_limits<double>::quiet_NaN();
    fail("'" + printable(word, 24) + "' is no number");
  }

  std::string_view rest_;
  Storage storage_;
};

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
  const PlyHead head = take_header(bytes);
  if (head.storage == Storage::kText) notes.add("PLY as text");
  if (head.storage == Storage::kBigEndian) notes.add("big-endian PLY");
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
