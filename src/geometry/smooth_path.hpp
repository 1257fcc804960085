// A path through tracked frames. A hand or a robot cannot change its velocity at once, but each
// frame's pose errs on its own: what smear, few points and row times leave of the pose jumps from
// frame to frame. A continuous path takes it out (Kerl et al. 2015 with a spline in the solver;
// here a local cubic through the poses, Savitzky and Golay 1964, for any stamps).
#pragma once

#include <span>
#include <vector>

#include "geometry/se3.hpp"

namespace ygslam {

struct PathPoint {
  double t_s = 0;
  Vec3 p_world = Vec3::Zero();
};

/// Camera centres in order of time, each from a cubic through those within a sixth of a second.
/// Where frames are missing or the camera was put somewhere else the path is interrupted; where
/// there are too few frames to tell motion from error, and where a cubic does not fit, the points
/// stay as they are.
[[nodiscard]] std::vector<Vec3> smooth_path(std::span<const PathPoint> path);

}  // namespace ygslam
