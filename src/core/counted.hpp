// Numbers of things in messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace ygslam {

/// "1 keyframe", "2 keyframes".
[[nodiscard]] inline std::string counted(std::size_t count, std::string_view thing) {
  return std::to_string(count) + " " + std::string(thing) + (count == 1 ? "" : "s");
}

/// 1, 10, 100, ...: the times at which what happens very often is told.
[[nodiscard]] constexpr bool is_power_of_ten(std::uint64_t n) {
  while (n > 0 && n % 10 == 0) n /= 10;
  return n == 1;
}

/// Of what may happen without end: whether its n-th time, from 1 on, is worth a line of its own.
[[nodiscard]] constexpr bool is_worth_a_line(std::uint64_t n) {
  constexpr std::uint64_t kAll = 10;  // then the 100th, the 1000th, ...
  return (n > 0 && n <= kAll) || is_power_of_ten(n);
}

}  // namespace ygslam
