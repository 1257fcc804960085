// The planes of a depth image: connected pieces of walls, tables, screens.
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam {

class PlanarPatches {
 public:
  /// Region growing on a coarse grid. Inverse depth is an affine function of the pixel on a plane,
  /// and a Kinect's noise in it hardly depends on the range.
  PlanarPatches(const Camera& camera, const DepthImage& depth_m);

  /// Each a vector pi with pi . p_camera = 1 on the plane: its normal by its distance.
  [[nodiscard]] const std::vector<Vec3>& planes() const { return planes_; }
  /// The patch about a recorded pixel that a point lies on; -1 if none.
  [[nodiscard]] int patch_at(const Eigen::Vector2f& uv_px, const Vec3& p_camera) const;

 private:
  struct Cell {
    Vec2 ray = Vec2::Zero();   // x / z, y / z
    double inverse_depth = 0;  // [1/m]; 0 = none
    int patch = -1;
  };
  [[nodiscard]] bool contains(int u, int v) const {
    return u >= 0 && v >= 0 && u < columns_ && v < rows_;
  }
  [[nodiscard]] Cell& at(int u, int v) {
    return cells_[static_cast<std::size_t>(v * columns_ + u)];
  }
  [[nodiscard]] const Cell& at(int u, int v) const {
    return cells_[static_cast<std::size_t>(v * columns_ + u)];
  }
  [[nodiscard]] bool is_seed(int u, int v) const;
  void grow_from(int u, int v);

  int step_px_ = 1;
  int columns_ = 0, rows_ = 0;
  std::vector<Cell> cells_;
  std::vector<Vec3> planes_;
};

/// Distance [m] of a point from a plane pi . p = 1.
[[nodiscard]] inline double distance_m(const Vec3& plane, const Vec3& p) {
  return std::abs(plane.dot(p) - 1) / plane.norm();
}

}  // namespace ygslam
