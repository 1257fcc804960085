// The groups of digits in the names of a folder's images.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace ygslam::name_digits {

/// A name's groups of digits, and what stands around them.
struct SplitName {
  std::string form;  ///< with \1 for each group
  std::vector<std::string_view> groups;
};
[[nodiscard]] SplitName split(std::string_view stem);

/// The form that most names have; of several the first in the alphabet; empty: no digits anywhere.
[[nodiscard]] std::string usual_form(const std::vector<SplitName>& names);
/// What stands between the groups of digits of a form.
[[nodiscard]] std::vector<std::string> signs_of(const std::string& form);

/// One group of digits in all names.
struct Column {
  std::vector<std::string_view> digits;
  std::vector<std::int64_t> values;  ///< empty: some do not fit
  std::size_t shortest = 0, longest = 0;
  bool varies = false;
};
[[nodiscard]] Column column_of(const std::vector<SplitName>& names, std::size_t group);

}  // namespace ygslam::name_digits
