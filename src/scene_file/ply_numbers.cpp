#include "scene_file/ply_numbers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <limits>
#include <sstream>

#include "io/text.hpp"

namespace ygslam::ply {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie");

constexpr const char* kTruncated = "truncated PLY file";

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

}  // namespace

void fail(const std::string& what) { throw Fault{what}; }

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

double Numbers::take(Kind kind) {
  if (storage_ == Storage::kText) return take_word();
  if (rest_.size() < size_of(kind)) fail(kTruncated);
  const double value = load(kind, rest_.data(), storage_ == Storage::kBigEndian);
  rest_.remove_prefix(size_of(kind));
  return value;
}

std::size_t Numbers::take_count(Kind kind) {
  const double count = take(kind);
  if (!(count >= 0 && count <= static_cast<double>(rest_.size()))) fail(kTruncated);
  return static_cast<std::size_t>(count);
}

void Numbers::skip(const Property& property) {
  for (std::size_t n = property.count ? take_count(*property.count) : 1; n > 0; --n)
    take(property.kind);
}

void Numbers::expect_rows(const Element& element) const {
  std::size_t least = 0;  // of a row: in text a digit and a blank each
  for (const Property& property : element.properties)
    least += storage_ == Storage::kText ? 2 : size_of(property.count.value_or(property.kind));
  if (least > 0 && (rest_.size() + 1) / least < element.count) fail(kTruncated);
}

bool Numbers::is_at_end() {
  if (storage_ == Storage::kText) skip_blanks();
  return rest_.empty();
}

void Numbers::skip_blanks() {
  rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
}

double Numbers::take_word() {
  skip_blanks();
  if (rest_.empty()) fail(kTruncated);
  const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n"));
  rest_.remove_prefix(word.size());
  if (const auto value = parse_number(word)) return *value;
  for (const std::string_view none : {"nan", "-nan", "NaN", "inf", "-inf"})
    if (word == none) return std::numeric_limits<double>::quiet_NaN();
  fail("'" + printable(word, 24) + "' is no number");
}

}  // namespace ygslam::ply
