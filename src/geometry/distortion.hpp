// OpenCV's distortion of a camera (Brown and Conrady), in plain numbers: compilers take several
// pixels at once.
#pragma once

#include "geometry/camera.hpp"

namespace ygslam {

/// What of a CameraConfig distorts: a copy in a function stays in registers while lists are
/// written.
struct Lens {
  double fx, fy, cx, cy, k1, k2, p1, p2, k3;
  explicit Lens(const CameraConfig& c)
      : fx(c.fx), fy(c.fy), cx(c.cx), cy(c.cy), k1(c.k1), k2(c.k2), p1(c.p1), p2(c.p2), k3(c.k3) {}
};

/// In place, of a point at z = 1: x'' = x' (1 + k1 r2 + k2 r4 + k3 r6) + 2 p1 x'y' + p2 (r2 + 2
/// x'^2), y alike.
inline void distort_normalized(const Lens& c, double& x, double& y) {
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  const double distorted_x = x * radial + 2.0 * c.p1 * x * y + c.p2 * (r2 + 2.0 * x * x);
  const double distorted_y = y * radial + c.p1 * (r2 + 2.0 * y * y) + 2.0 * c.p2 * x * y;
  x = distorted_x, y = distorted_y;
}

/// In place, of an ideal pixel, as Camera::distort().
inline void distort_pixel(const Lens& c, double& u_px, double& v_px) {
  double x = (u_px - c.cx) / c.fx, y = (v_px - c.cy) / c.fy;
  distort_normalized(c, x, y);
  u_px = c.fx * x + c.cx, v_px = c.fy * y + c.cy;
}

}  // namespace ygslam
