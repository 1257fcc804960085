// What of a mesh hangs together.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace ygslam {

/// Sets of vertices that triangles join.
class Pieces {
 public:
  explicit Pieces(std::size_t vertices) : parent_(vertices) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t p = root(a), q = root(b);
    parent_[std::max(p, q)] = std::min(p, q);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace ygslam
