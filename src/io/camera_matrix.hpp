// The 3x3 or 4x4 matrix of a camera, which many formats have in them.
#pragma once

#include <span>
#include <string>

#include "geometry/camera.hpp"

namespace ygslam {

/// Sets fx, fy, cx and cy. @param m row by row.
/// @return what is wrong with it (no matrix of a camera, a skew, a translation), empty if nothing.
[[nodiscard]] std::string set_camera_matrix(CameraConfig& camera, std::span<const double> m);

}  // namespace ygslam
