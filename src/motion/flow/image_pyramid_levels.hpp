// The inside of ImagePyramid. Include from .cpp files only.
#pragma once

#include <vector>

#include "image/padded_image.hpp"
#include "motion/flow/image_pyramid.hpp"

namespace ygslam {

struct ImagePyramid::Levels {
  // Their borders hold a flow window about any pixel of the image, and the vector loads beyond it.
  std::vector<PaddedImage> level;  // from fine to coarse; small images get fewer than asked for
  int window_px = 0;
};

}  // namespace ygslam
