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

/// Of what may happen without end: whether its n-th time, from 1 on, is worth a line of its own.
[[nodiscard]] constexpr bool is_worth_a_line(std::uint64_t n) {
  constexpr std::uint64_t kAll = 10;  // then the 100th, the 1000th, ...
  if (n <= kAll) return n > 0;
  while (n % 10 == 0) n /= 10;
  return n == 1;
}

}  // namespace ygslam
