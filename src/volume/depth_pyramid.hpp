// The nearest depth in any square of an image, from four lookups (a sparse table for range minima
// in two dimensions).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace ygslam {

/// Minima over squares of 2^level tiles of 4 x 4 pixels, one square beginning at every tile.
class DepthPyramid {
 public:
  static constexpr int kTile_px = 4;
  static constexpr int kLevels = 7;
  static constexpr std::uint16_t kNone = 0xffff;

  /// @param nearest of each tile, row by row; kNone = no depth.
  void assign(int columns, int rows, std::span<const std::uint16_t> nearest);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  /// Plane `level` begins at level * plane_size(); its entry of a tile is the minimum over the
  /// square of 2^level tiles that begins there, as far as it lies in the image. Two bytes behind
  /// the last entry are readable.
  [[nodiscard]] const std::uint16_t* planes() const { return planes_.data(); }
  [[nodiscard]] int plane_size() const { return columns_ * rows_; }

 private:
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint16_t> planes_;
};

}  // namespace ygslam
