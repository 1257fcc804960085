#include "motion/image_pyramid.hpp"

#include <opencv2/video/tracking.hpp>

#include "image/cv_view.hpp"
#include "motion/image_pyramid_levels.hpp"

namespace ygslam {

ImagePyramid::ImagePyramid(const GreyImage& image, int levels, int window_px) {
  CHECK(!image.empty() && levels >= 0 && window_px >= 3);
  auto built = std::make_shared<Levels>();
  built->window_px = window_px;
  built->width = image.width();
  built->height = image.height();
  // tryReuseInputImage = false: the pyramid outlives the frame it was built from.
  built->levels =
      cv::buildOpticalFlowPyramid(cv_view(image), built->mats, {window_px, window_px}, levels, true,
                                  cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
  levels_ = std::move(built);
}

int ImagePyramid::width() const { return empty() ? 0 : levels_->width; }
int ImagePyramid::height() const { return empty() ? 0 : levels_->height; }

}  // namespace ygslam
