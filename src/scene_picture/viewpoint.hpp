// From where a picture of the scene is taken.
#pragma once

#include <span>
#include <vector>

#include "scene/scene.hpp"

namespace ygslam {

/// A pinhole camera without distortion, its principal point in the middle.
struct Viewpoint {
  int width = 1280, height = 960;  ///< [px]
  double focal_px = 1100;
  SE3 T_camera_world;  ///< camera: x right, y down, z ahead
};

/// @param eye_world, target_world not the same point. @param up_world what is up in the picture;
/// where it lies along the line of sight another direction takes its place.
[[nodiscard]] SE3 look_at(const Vec3& eye_world, const Vec3& target_world, const Vec3& up_world);

struct Overview {
  int width = 1280, height = 960;  ///< [px]
  double elevation_rad = 0.9;      ///< of the camera over the horizon, up to pi / 2: straight down
  double azimuth_rad = 0.4;        ///< turn about up; at 0 the longer side of the scene lies across
  double cut_above_m = 1e9;        ///< what is higher over the floor is not drawn
  std::vector<Vec3> also_world{};  ///< to be in the picture as well, e.g. the way of a camera
};

/// The whole scene from above at an angle, filling the picture; stray points are left out of
/// account. Without any point the camera looks at the world's origin.
[[nodiscard]] Viewpoint overview(std::span<const SurfacePoint> points, const Gravity& gravity,
                                 const Overview& options = {});

}  // namespace ygslam
