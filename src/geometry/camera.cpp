#include "geometry/camera.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

// OpenCV camera model: x'' = x' (1 + k1 r2 + k2 r4 + k3 r6) + 2 p1 x'y' + p2 (r2 + 2 x'^2), y
// alike.
Vec2 distort_normalized(const CameraConfig& c, const Vec2& x) {
  const double r2 = x.squaredNorm();
  const double radial = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  return {x.x() * radial + 2.0 * c.p1 * x.x() * x.y() + c.p2 * (r2 + 2.0 * x.x() * x.x()),
          x.y() * radial + c.p1 * (r2 + 2.0 * x.y() * x.y()) + 2.0 * c.p2 * x.x() * x.y()};
}

}  // namespace

Camera::Camera(const CameraConfig& config) : config_(config) {
  ideal_bounds_ = {0.0, 0.0, config.width - 1.0, config.height - 1.0};
  if (!config.is_distorted()) return;
  undistorted_.resize(static_cast<std::size_t>(config.width) * config.height);
  std::array<double, 4> b = {1e9, 1e9, -1e9, -1e9};
  for (int v = 0; v < config.height; ++v) {
    for (int u = 0; u < config.width; ++u) {
      const Vec2 ideal = undistort_exact({u, v});
      undistorted_[static_cast<std::size_t>(v) * config.width + u] = ideal.cast<float>();
      b = {std::min(b[0], ideal.x()), std::min(b[1], ideal.y()), std::max(b[2], ideal.x()),
           std::max(b[3], ideal.y())};
    }
  }
  ideal_bounds_ = b;
}

Vec2 Camera::undistort_exact(const Vec2& uv_px) const {
  const Vec2 target((uv_px.x() - config_.cx) / config_.fx, (uv_px.y() - config_.cy) / config_.fy);
  Vec2 x = target;
  for (int i = 0; i < 50; ++i) {  // fixed point iteration, as in Zhang's toolbox
    const Vec2 error = distort_normalized(config_, x) - target;
    x -= error;
    if (error.squaredNorm() < 1e-20) break;
  }
  if (!x.allFinite()) x = target;
  return {config_.fx * x.x() + config_.cx, config_.fy * x.y() + config_.cy};
}

Vec2 Camera::undistort(const Vec2& uv_px) const {
  if (undistorted_.empty()) return uv_px;
  const double u = std::clamp(uv_px.x(), 0.0, config_.width - 1.001);
  const double v = std::clamp(uv_px.y(), 0.0, config_.height - 1.001);
  const int u0 = static_cast<int>(u);
  const int v0 = static_cast<int>(v);
  const double a = u - u0;
  const double b = v - v0;
  const auto* row = &undistorted_[static_cast<std::size_t>(v0) * config_.width + u0];
  const auto* below = row + config_.width;
  const Vec2 ideal = (1 - b) * ((1 - a) * row[0].cast<double>() + a * row[1].cast<double>()) +
                     b * ((1 - a) * below[0].cast<double>() + a * below[1].cast<double>());
  return ideal + (uv_px - Vec2(u, v));
}

Vec2 Camera::distort(const Vec2& ideal_px) const {
  if (undistorted_.empty()) return ideal_px;
  const Vec2 x((ideal_px.x() - config_.cx) / config_.fx, (ideal_px.y() - config_.cy) / config_.fy);
  const Vec2 d = distort_normalized(config_, x);
  return {config_.fx * d.x() + config_.cx, config_.fy * d.y() + config_.cy};
}

}  // namespace ygslam
