// A camera for tests.
#pragma once

#include "geometry/camera.hpp"

namespace ygslam::geometry_test {

/// Without distortion, the principal point in the middle of the image.
inline Camera test_camera(double focal_px = 525, int width = 640, int height = 480) {
  CameraConfig c;
  c.fx = c.fy = focal_px;
  c.width = width, c.height = height;
  c.cx = (width - 1) / 2.0, c.cy = (height - 1) / 2.0;
  return Camera(c);
}

}  // namespace ygslam::geometry_test
