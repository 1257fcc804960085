// A grey image with a border of mirrored pixels, so that filters, patches and vector loads may
// reach beyond it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "image/image.hpp"

namespace ygslam {

class PaddedImage {
 public:
  PaddedImage() = default;
  PaddedImage(int width, int height, int border_px) { resize(width, height, border_px); }

  /// The pixels are undefined afterwards. Keeps the memory of earlier, larger images.
  void resize(int width, int height, int border_px);
  /// Copies an image and mirrors its border.
  void assign(const GreyImage& image, int border_px);
  /// Fills the border by mirroring about the outermost pixels (they are not repeated).
  void mirror_border();

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int border_px() const { return border_px_; }
  [[nodiscard]] int stride() const { return stride_; }
  /// Pixel (0, v); readable from -border_px to width + border_px - 1, v likewise.
  [[nodiscard]] std::uint8_t* row(int v) { return pixels_.get() + offset(v); }
  [[nodiscard]] const std::uint8_t* row(int v) const { return pixels_.get() + offset(v); }

 private:
  [[nodiscard]] std::ptrdiff_t offset(int v) const {
    return static_cast<std::ptrdiff_t>(v + border_px_) * stride_ + border_px_;
  }
  int width_ = 0;
  int height_ = 0;
  int border_px_ = 0;
  int stride_ = 0;
  std::size_t capacity_ = 0;
  std::unique_ptr<std::uint8_t[]> pixels_;
};

}  // namespace ygslam
