#include "io/camera_matrix.hpp"

#include <cmath>

#include "core/log.hpp"  // brings {fmt}

namespace ygslam {

std::string set_camera_matrix(CameraConfig& camera, std::span<const double> m) {
  const std::size_t side = m.size() == 16 ? 4 : 3;
  if (m.size() != 9 && m.size() != 16) return "is no 3x3 or 4x4 matrix";
  const auto at = [&](std::size_t row, std::size_t column) { return m[row * side + column]; };
  // Products of matrices leave crumbs.
  const auto is = [&](std::size_t row, std::size_t column, double value) {
    return std::abs(at(row, column) - value) < 1e-6;
  };
  const bool is_by_columns = is(0, 2, 0) && is(1, 2, 0) && !is(2, 0, 0) && !is(2, 1, 0);
  if (is_by_columns) return "is a camera matrix column by column; write it row by row";
  if (!is(2, 0, 0) || !is(2, 1, 0) || !is(2, 2, 1) || !is(1, 0, 0))
    return "is no matrix fx 0 cx, 0 fy cy, 0 0 1 of a camera";
  if (!is(0, 1, 0)) return fmt::format("has a skew of {:g}; only cameras without are read", m[1]);
  if (side == 4) {
    if (!is(0, 3, 0) || !is(1, 3, 0) || !is(2, 3, 0))
      return fmt::format("has a fourth column {:g} {:g} {:g}: a projection or a pose, no camera",
                         at(0, 3), at(1, 3), at(2, 3));
    if (!is(3, 0, 0) || !is(3, 1, 0) || !is(3, 2, 0) || !is(3, 3, 1))
      return "has a fourth row that is not 0 0 0 1";
  }
  camera.fx = at(0, 0), camera.cx = at(0, 2), camera.fy = at(1, 1), camera.cy = at(1, 2);
  return {};
}

}  // namespace ygslam
