// The camera of this folder's tests.
#pragma once

#include "geometry/camera.hpp"

namespace ygslam::testing {

inline Camera test_camera() {
  CameraConfig c;
  c.fx = c.fy = 525, c.cx = 319.5, c.cy = 239.5;
  return Camera(c);
}

}  // namespace ygslam::testing
