// What one group of digits, or two, in the names of images may say of time.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/name_digits.hpp"

namespace ygslam::name_digits {

/// One way to read the names.
struct Reading {
  enum class Kind { kNone, kUnclear, kFrames, kTime } kind = Kind::kNone;
  std::vector<std::int64_t> ns;  ///< of each name
  int decimals = 6;              ///< of seconds that it is good for
  std::string what;              ///< taken as; or why it is not clear
  bool since_1970 = false;
  std::size_t first = 0, last = 0;  ///< groups it uses
};
inline constexpr const char* kTimeOfDay =
    "a time of day; read are seconds (12.345), whole milli-, micro- or nanoseconds, and numbers of "
    "frames";
[[nodiscard]] Reading unclear(const std::string& why);

/// What a group of digits alone may be.
[[nodiscard]] Reading read_number(const Column& column);
/// Two groups with one sign between them as seconds and their fraction.
/// @param is_pointed the whole name is a number with a decimal point.
[[nodiscard]] Reading read_pair(const Column& seconds, const Column& fraction, bool is_pointed);

/// Indices from the smallest value to the largest.
[[nodiscard]] std::vector<std::size_t> order_of(const std::vector<std::int64_t>& values);

}  // namespace ygslam::name_digits
