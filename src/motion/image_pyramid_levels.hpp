// The inside of ImagePyramid. Include from .cpp files only.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "motion/image_pyramid.hpp"

namespace ygslam {

struct ImagePyramid::Levels {
  std::vector<cv::Mat> mats;  // image, gradients, image, gradients, ... from fine to coarse
  int levels = 0;             // as built: small images get fewer than asked for
  int window_px = 0;
  int width = 0, height = 0;
};

}  // namespace ygslam
