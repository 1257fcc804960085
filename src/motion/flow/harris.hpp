// Harris corners for the classic motion check.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "motion/flow/image_pyramid.hpp"

namespace ygslam {

/// Up to max_corners corners of the pyramid's full image, strongest first (Harris and Stephens
/// 1988), at least min_distance_px apart.
[[nodiscard]] std::vector<Eigen::Vector2f> harris_corners(const ImagePyramid& image,
                                                          int max_corners, double min_distance_px);

}  // namespace ygslam
