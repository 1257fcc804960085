#include "segment/letterbox.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "image/cv_view.hpp"

namespace ygslam {

Letterbox make_letterbox(int image_width, int image_height, int net_width, int net_height,
                         Placement placement) {
  CHECK(image_width > 0 && image_height > 0 && net_width > 0 && net_height > 0);
  const double scale = std::min(static_cast<double>(net_width) / image_width,
                                static_cast<double>(net_height) / image_height);
  const auto scaled = [&](int size, int limit) {
    return std::clamp(static_cast<int>(std::lround(size * scale)), 1, limit);
  };
  Letterbox box{image_width, image_height, net_width, net_height, net_width, net_height};
  if (placement == Placement::kStretched) return box;
  box.inner_width = scaled(image_width, net_width);
  box.inner_height = scaled(image_height, net_height);
  if (placement == Placement::kTopLeft) return box;
  box.pad_left = (net_width - box.inner_width) / 2;
  box.pad_top = (net_height - box.inner_height) / 2;
  return box;
}

ColourImage letterboxed(const ColourImage& image, const Letterbox& box) {
  CHECK(image.width() == box.image_width && image.height() == box.image_height);
  if (box.identity()) return image;
  ColourImage out(box.net_width, box.net_height, {kLetterboxGrey, kLetterboxGrey, kLetterboxGrey});
  cv::Mat inner =
      cv_view(out)(cv::Rect(box.pad_left, box.pad_top, box.inner_width, box.inner_height));
  cv::resize(cv_view(image), inner, inner.size(), 0, 0, cv::INTER_LINEAR);
  return out;
}

}  // namespace ygslam
