#include "volume/depth_pyramid.hpp"

#include <algorithm>

#include "core/check.hpp"

namespace ygslam {

void DepthPyramid::assign(int columns, int rows, std::span<const std::uint16_t> nearest) {
  const std::size_t size = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  CHECK(nearest.size() == size);
  columns_ = columns;
  rows_ = rows;
  planes_.resize(kLevels * size + 1);
  std::copy(nearest.begin(), nearest.end(), planes_.begin());
  for (int level = 1; level < kLevels; ++level) {
    const int half = 1 << (level - 1);
    const std::uint16_t* from = planes_.data() + static_cast<std::size_t>(level - 1) * size;
    std::uint16_t* to = planes_.data() + static_cast<std::size_t>(level) * size;
    for (int y = 0; y < rows; ++y) {
      const std::uint16_t* upper = from + static_cast<std::ptrdiff_t>(y) * columns;
      const std::uint16_t* lower =
          from + static_cast<std::ptrdiff_t>(std::min(y + half, rows - 1)) * columns;
      std::uint16_t* row = to + static_cast<std::ptrdiff_t>(y) * columns;
      const int whole = std::max(columns - half, 0);
      for (int x = 0; x < whole; ++x)
        row[x] = std::min(std::min(upper[x], upper[x + half]), std::min(lower[x], lower[x + half]));
      for (int x = whole; x < columns; ++x) row[x] = std::min(upper[x], lower[x]);
    }
  }
}

}  // namespace ygslam
