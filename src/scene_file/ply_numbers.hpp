// The header of a PLY file and the numbers behind it, as text or binary in either byte order.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ygslam::ply {

enum class Kind { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

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
/// Throws a Fault, which the reader turns into its error.
[[noreturn]] void fail(const std::string& what);

enum class Storage { kText, kLittleEndian, kBigEndian };

struct PlyHead {
  Storage storage = Storage::kText;
  std::vector<Element> elements;
};

/// Moves `bytes` on to the data. Lines may end in CR LF.
[[nodiscard]] PlyHead take_header(std::string_view& bytes);

/// The numbers behind the header, one after the other; they fail() where they end early.
class Numbers {
 public:
  Numbers(std::string_view bytes, Storage storage) : rest_(bytes), storage_(storage) {}

  double take(Kind kind);
  /// Of a list, as many as can be there.
  std::size_t take_count(Kind kind);
  void skip(const Property& property);
  /// Fails where so many rows cannot be there, before anything is allocated for them.
  void expect_rows(const Element& element) const;
  [[nodiscard]] bool is_at_end();

 private:
  void skip_blanks();
  double take_word();

  std::string_view rest_;
  Storage storage_;
};

}  // namespace ygslam::ply
