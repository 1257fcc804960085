// A grey image at several scales, as optical flow needs it. Built once per frame: the current
// frame's pyramid is the next frame's previous one.
#pragma once

#include <memory>

#include "image/image.hpp"

namespace ygslam {

class ImagePyramid {
 public:
  ImagePyramid() = default;
  /// @param levels halvings on top of the full image, >= 0. @param window_px side of the flow
  /// window, odd, >= 3: the levels carry a border that lets such windows reach beyond the image.
  ImagePyramid(const GreyImage& image, int levels, int window_px);

  [[nodiscard]] bool empty() const { return levels_ == nullptr; }
  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;

  struct Levels;  // in image_pyramid_levels.hpp, for .cpp files
  [[nodiscard]] const Levels& levels() const { return *levels_; }

 private:
  std::shared_ptr<const Levels> levels_;
};

}  // namespace ygslam
