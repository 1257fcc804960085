// The inside of ImagePyramid. Include from .cpp files only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "motion/image_pyramid.hpp"

namespace ygslam {

/// One level: an image with a border of mirrored pixels wide enough for a flow window about any
/// pixel of the image, and for the vector loads that run on beyond it.
class PyramidLevel {
 public:
  PyramidLevel(int width, int height, int border_px)
      : width_(width),
        height_(height),
        border_px_(border_px),
        stride_((width + 2 * border_px + 31) / 32 * 32),
        pixels_(std::make_unique_for_overwrite<std::uint8_t[]>(static_cast<std::size_t>(stride_) *
                                                               (height + 2 * border_px))) {}

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int border_px() const { return border_px_; }
  [[nodiscard]] std::ptrdiff_t stride() const { return stride_; }
  /// Pixel (0, v); readable from -border_px to width + border_px - 1, v likewise.
  [[nodiscard]] std::uint8_t* row(int v) { return pixels_.get() + offset(v); }
  [[nodiscard]] const std::uint8_t* row(int v) const { return pixels_.get() + offset(v); }
  /// Fills the border by mirroring about the outermost pixels (they are not repeated).
  void mirror_border();

 private:
  [[nodiscard]] std::ptrdiff_t offset(int v) const {
    return static_cast<std::ptrdiff_t>(v + border_px_) * stride_ + border_px_;
  }
  int width_;
  int height_;
  int border_px_;
  std::ptrdiff_t stride_;
  std::unique_ptr<std::uint8_t[]> pixels_;
};

struct ImagePyramid::Levels {
  std::vector<PyramidLevel> level;  // from fine to coarse; small images get fewer than asked for
  int window_px = 0;
};

}  // namespace ygslam
