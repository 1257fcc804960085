// A point of a coloured cloud.
#pragma once

#include <Eigen/Core>

#include "image/image.hpp"

namespace ygslam {

struct ColouredPoint {
  Eigen::Vector3f p_world = Eigen::Vector3f::Zero();  ///< [m]
  Rgb8 colour;
};

}  // namespace ygslam
