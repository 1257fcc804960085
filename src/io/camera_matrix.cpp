#include "io/camera_matrix.hpp"

#include "core/log.hpp"  // brings {fmt}

namespace ygslam {

std::string set_camera_matrix(CameraConfig& camera, std::span<const double> m) {
  const std::size_t side = m.size() == 16 ? 4 : 3;
  if (m.size() != 9 && m.size() != 16) return "is no 3x3 or 4x4 matrix";
  const auto at = [&](std::size_t row, std::size_t column) { return m[row * side + column]; };
  const bool is_by_columns = at(0, 2) == 0 && at(1, 2) == 0 && at(2, 0) != 0 && at(2, 1) != 0;
  if (is_by_columns) return "is a camera matrix column by column; write it row by row";
  if (at(2, 0) != 0 || at(2, 1) != 0 || at(2, 2) != 1 || at(1, 0) != 0)
    return "is no matrix fx 0 cx, 0 fy cy, 0 0 1 of a camera";
  if (at(0, 1) != 0) return fmt::format("has a skew of {:g}; only cameras without are read", m[1]);
  if (side == 4) {
    if (at(0, 3) != 0 || at(1, 3) != 0 || at(2, 3) != 0)
      return fmt::format("has a fourth column {:g} {:g} {:g}: a projection or a pose, no camera",
                         at(0, 3), at(1, 3), at(2, 3));
    if (at(3, 0) != 0 || at(3, 1) != 0 || at(3, 2) != 0 || at(3, 3) != 1)
      return "has a fourth row that is not 0 0 0 1";
  }
  camera.fx = at(0, 0), camera.cx = at(0, 2), camera.fy = at(1, 1), camera.cy = at(1, 2);
  return {};
}

}  // namespace ygslam
