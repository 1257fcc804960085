#include "image/padded_image.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace ygslam {
namespace {

// Index mirrored about 0 and size - 1, any distance away.
int mirrored(int i, int size) {
  if (size == 1) return 0;
  const int period = 2 * (size - 1);
  i = std::abs(i) % period;
  return i < size ? i : period - i;
}

}  // namespace

void PaddedImage::resize(int width, int height, int border_px) {
  width_ = width;
  height_ = height;
  border_px_ = border_px;
  stride_ = (width + 2 * border_px + 31) / 32 * 32;
  const auto needed = static_cast<std::size_t>(stride_) * (height + 2 * border_px) + border_px;
  if (needed <= capacity_) return;
  pixels_ = std::make_unique_for_overwrite<std::uint8_t[]>(needed);
  capacity_ = needed;
}

void PaddedImage::assign(const GreyImage& image, int border_px) {
  resize(image.width(), image.height(), border_px);
  for (int v = 0; v < height_; ++v) {
    std::memcpy(row(v), image.row(v), static_cast<std::size_t>(width_));
  }
  mirror_border();
}

void PaddedImage::mirror_border() {
  for (int v = 0; v < height_; ++v) {
    std::uint8_t* const p = row(v);
    if (border_px_ < width_) {
      std::reverse_copy(p + 1, p + 1 + border_px_, p - border_px_);
      std::reverse_copy(p + width_ - 1 - border_px_, p + width_ - 1, p + width_);
      continue;
    }
    for (int i = 1; i <= border_px_; ++i) {
      p[-i] = p[mirrored(i, width_)];
      p[width_ - 1 + i] = p[mirrored(width_ - 1 + i, width_)];
    }
  }
  const auto bytes = static_cast<std::size_t>(width_ + 2 * border_px_);
  for (int i = 1; i <= border_px_; ++i) {
    std::memcpy(row(-i) - border_px_, row(mirrored(i, height_)) - border_px_, bytes);
    std::memcpy(row(height_ - 1 + i) - border_px_,
                row(mirrored(height_ - 1 + i, height_)) - border_px_, bytes);
  }
}

}  // namespace ygslam
