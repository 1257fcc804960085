#include "geometry/camera.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/distortion.hpp"

namespace ygslam {
namespace {

Vec2 distorted(const CameraConfig& c, Vec2 x) {
  distort_normalized(Lens(c), x.x(), x.y());
  return x;
}

Eigen::Matrix2d distortion_jacobian(const CameraConfig& c, const Vec2& x) {
  const double r2 = x.squaredNorm();
  const double radial = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  const double slope = 2.0 * (c.k1 + r2 * (2.0 * c.k2 + r2 * 3.0 * c.k3));  // of radial, by r2 / 2
  const double mixed = slope * x.x() * x.y() + 2.0 * (c.p1 * x.x() + c.p2 * x.y());
  Eigen::Matrix2d J;
  J << radial + slope * x.x() * x.x() + 2.0 * c.p1 * x.y() + 6.0 * c.p2 * x.x(), mixed,  //
      mixed, radial + slope * x.y() * x.y() + 6.0 * c.p1 * x.y() + 2.0 * c.p2 * x.x();
  return J;
}

constexpr double kConverged2 = 1e-20;  // squared, in normalised coordinates

// Newton's method on the side of the centre: a step that would cross a fold of the distorted image,
// or does not come nearer, is halved. @return the nearest it came.
Vec2 undistort_normalized(const CameraConfig& c, const Vec2& target) {
  Vec2 x = distortion_jacobian(c, target).determinant() > 0 ? target : Vec2::Zero();
  Vec2 error = distorted(c, x) - target;
  Vec2 step = Vec2::Zero();
  const auto comes_nearer = [&] {
    const Vec2 next = x - step;
    const Vec2 next_error = distorted(c, next) - target;
    if (!(next_error.squaredNorm() < error.squaredNorm()) ||
        distortion_jacobian(c, next).determinant() <= 0)
      return false;
    x = next;
    error = next_error;
    return true;
  };
  for (int i = 0; i < 50 && error.squaredNorm() > kConverged2; ++i) {
    step = distortion_jacobian(c, x).inverse() * error;
    int halvings = 0;
    while (!comes_nearer() && ++halvings < 12) step *= 0.5;
    if (halvings == 12) break;  // at a fold, or as near as rounding allows
  }
  return x;
}

}  // namespace

std::optional<Vec2> pixel_without_ray(const CameraConfig& c) {
  if (!c.is_distorted()) return std::nullopt;
  constexpr int kSteps = 32;
  constexpr double kExact_px = 1e-3;
  const auto has_ray = [&](const Vec2& uv_px) {
    const Vec2 target((uv_px.x() - c.cx) / c.fx, (uv_px.y() - c.cy) / c.fy);
    const Vec2 x = undistort_normalized(c, target);
    if (!((distorted(c, x) - target).norm() * std::max(c.fx, c.fy) < kExact_px)) return false;
    for (int i = 1; i <= kSteps; ++i)
      if (distortion_jacobian(c, x * i / kSteps).determinant() <= 0) return false;
    return true;
  };
  for (int i = 0; i <= kSteps; ++i) {
    const double u = (c.width - 1.0) * i / kSteps;
    const double v = (c.height - 1.0) * i / kSteps;
    for (const Vec2& uv_px :
         {Vec2(u, 0), Vec2(u, c.height - 1.0), Vec2(0, v), Vec2(c.width - 1.0, v)})
      if (!has_ray(uv_px)) return uv_px;
  }
  return std::nullopt;
}

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
  const Vec2 x = undistort_normalized(config_, target);
  return {config_.fx * x.x() + config_.cx, config_.fy * x.y() + config_.cy};
}

Vec2 Camera::undistort(const Vec2& uv_px) const {
  if (undistorted_.empty()) return uv_px;
  const double u = std::clamp(uv_px.x(), 0.0, config_.width - 1.0);
  const double v = std::clamp(uv_px.y(), 0.0, config_.height - 1.0);
  const int u0 = std::clamp(static_cast<int>(u), 0, std::max(0, config_.width - 2));
  const int v0 = std::clamp(static_cast<int>(v), 0, std::max(0, config_.height - 2));
  const double a = u - u0;
  const double b = v - v0;
  const auto* row = &undistorted_[static_cast<std::size_t>(v0) * config_.width + u0];
  const auto* below = config_.height > 1 ? row + config_.width : row;
  const int right = config_.width > 1 ? 1 : 0;
  const Vec2 ideal = (1 - b) * ((1 - a) * row[0].cast<double>() + a * row[right].cast<double>()) +
                     b * ((1 - a) * below[0].cast<double>() + a * below[right].cast<double>());
  return ideal + (uv_px - Vec2(u, v));
}

Vec2 Camera::distort(const Vec2& ideal_px) const {
  if (undistorted_.empty()) return ideal_px;
  Vec2 uv_px = ideal_px;
  distort_pixel(Lens(config_), uv_px.x(), uv_px.y());
  return uv_px;
}

}  // namespace ygslam
