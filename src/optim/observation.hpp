// A point seen in an image, with its depth where the sensor gave one: the residual of every
// least-squares problem here.
#pragma once

#include "geometry/se3.hpp"

namespace ygslam {

/// Residuals, each divided by its standard deviation:
///   [ project(p_cam) - ideal_px ] / sigma_px                 (2)
///   [ 1 / p_cam.z - 1 / depth_m ] / (sigma_depth_m / depth_m^2)   (1, where depth_m > 0)
/// Inverse depth because the sensor measures disparity, whose noise is nearly constant.
struct Observation {
  Vec2 ideal_px = Vec2::Zero();
  double depth_m = 0;        ///< 0 = not measured
  double sigma_px = 1;       ///< > 0
  double sigma_depth_m = 1;  ///< > 0 where depth_m > 0
  double weight = 1;  ///< 0..1: how much it is trusted to be static; scales the squared error
};

}  // namespace ygslam
