// A grey image with a border of mirrored pixels, so that filters and patches may reach beyond it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "image/image.hpp"

namespace ygslam {

class PaddedImage {
 public:
  /// Readable bytes beyond each side of the image, for vector loads.
  static constexpr int kPad = 32;
  /// So many of them hold mirrored pixels.
  static constexpr int kMirror = 12;

  /// Keeps the memory of earlier, larger images.
  void resize(int width, int height) {
    width_ = width;
    height_ = height;
    stride_ = (width + 2 * kPad + 31) / 32 * 32;
    pixels_.resize(static_cast<std::size_t>(stride_) * (height + 2 * kPad) + kPad);
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int stride() const { return stride_; }
  /// Pixel (0, v); readable from -kPad to width + kPad - 1, v likewise.
  [[nodiscard]] std::uint8_t* row(int v) { return pixels_.data() + offset(v); }
  [[nodiscard]] const std::uint8_t* row(int v) const { return pixels_.data() + offset(v); }

  /// Copies an image and mirrors its border.
  void assign(const GreyImage& image);
  /// Fills the border by mirroring about the outermost pixels (they are not repeated).
  void mirror_border();

 private:
  [[nodiscard]] std::size_t offset(int v) const {
    return static_cast<std::size_t>(v + kPad) * stride_ + kPad;
  }
  int width_ = 0;
  int height_ = 0;
  int stride_ = 0;
  std::vector<std::uint8_t> pixels_;
};

/// Bilinear reduction: pixel (u, v) of `target` lies at (ratio u, ratio v) of `source`, so that a
/// level's pixel times its scale is the pixel of the full image, without any offset.
/// @param ratio in [1, 2]. `target` gets the size of all samples inside `source` and its border.
void reduce(const PaddedImage& source, double ratio, int width, int height, PaddedImage& target);

/// Gaussian blur, 7x7, sigma 2 px, weights in 1/256 (the smoothing of Rublee et al. 2011 before the
/// binary tests). Also fills 8 px beyond the image.
void blur_7x7(const PaddedImage& source, PaddedImage& target);

}  // namespace ygslam
