// Lists of images whose clock was set back while they were recorded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/time.hpp"

namespace ygslam {

struct ClockReset {
  std::size_t place = 0;      ///< of the first line after it
  std::int64_t back_ns = 0;   ///< by how much that line goes back
  std::int64_t shift_ns = 0;  ///< to be added from there on, so that time goes on by the usual step
};

/// Where a list's lines begin again in an earlier time and rise steadily from there on. Lines that
/// are merely out of order (reversed, shuffled, parts that fit together once sorted) are none.
/// @param stamps in the order of the lines, not negative. @return in the same order.
[[nodiscard]] std::vector<ClockReset> clock_resets(std::span<const Timestamp> stamps);

}  // namespace ygslam
