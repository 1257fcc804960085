// A camera for tests, and what is drawn for them.
#pragma once

#include "core/rng.hpp"
#include "geometry/camera.hpp"
#include "geometry/random_vector.hpp"

namespace ygslam::geometry_test {

/// Without distortion, the principal point in the middle of the image.
inline Camera test_camera(double focal_px = 525, int width = 640, int height = 480) {
  CameraConfig c;
  c.fx = c.fy = focal_px;
  c.width = width, c.height = height;
  c.cx = (width - 1) / 2.0, c.cy = (height - 1) / 2.0;
  return Camera(c);
}

/// Of an image of 640x480.
inline Vec2 random_pixel(Rng& rng) {
  const double v = rng.uniform(0, 479);
  return {rng.uniform(0, 639), v};
}

}  // namespace ygslam::geometry_test
