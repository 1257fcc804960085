#include "geometry/triangulation.hpp"

#include <cmath>

namespace ygslam {
namespace {

constexpr double kNearest_m = 0.1;

}  // namespace

std::optional<Vec3> triangulate(const Camera& camera, const SE3& T_a_world, const Vec2& a_px,
                                const SE3& T_b_world, const Vec2& b_px, double min_parallax_rad) {
  const SE3 T_world_a = T_a_world.inverse();
  const SE3 T_world_b = T_b_world.inverse();
  const Vec3 d_a = (T_world_a.R() * camera.unproject(a_px, 1.0)).normalized();
  const Vec3 d_b = (T_world_b.R() * camera.unproject(b_px, 1.0)).normalized();
  const double cosine = d_a.dot(d_b);
  if (cosine > std::cos(min_parallax_rad)) return std::nullopt;
  // Normal equations of |a + s d_a - b - t d_b|^2.
  const Vec3 baseline = T_world_b.t() - T_world_a.t();
  const double denominator = 1.0 - cosine * cosine;
  const double s = (baseline.dot(d_a) - cosine * baseline.dot(d_b)) / denominator;
  const double t = (cosine * baseline.dot(d_a) - baseline.dot(d_b)) / denominator;
  if (s < kNearest_m || t < kNearest_m) return std::nullopt;
  return 0.5 * (T_world_a.t() + s * d_a + T_world_b.t() + t * d_b);
}

}  // namespace ygslam
