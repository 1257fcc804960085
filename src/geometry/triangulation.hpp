// A point from the rays of two views.
#pragma once

#include <optional>

#include "geometry/camera.hpp"

namespace ygslam {

/// Point nearest to both rays (midpoint). @return nullopt if they are nearly parallel or it lies
/// behind a camera or nearer than 0.1 m to it. Poses T_camera_world, pixels ideal.
[[nodiscard]] std::optional<Vec3> triangulate(const Camera& camera, const SE3& T_a_world,
                                              const Vec2& a_px, const SE3& T_b_world,
                                              const Vec2& b_px, double min_parallax_rad);

}  // namespace ygslam
