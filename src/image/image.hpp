// A plain image that owns its pixels, rows contiguous without padding. OpenCV sees it through
// image/cv_view.hpp, in .cpp files only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/check.hpp"

namespace ygslam {

struct Rgb8 {
  std::uint8_t r = 0, g = 0, b = 0;
  bool operator==(const Rgb8&) const = default;
};

template <typename T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, T fill = T{})
      : width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * height, fill) {
    CHECK(width >= 0 && height >= 0);
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] bool empty() const { return pixels_.empty(); }
  [[nodiscard]] std::size_t size() const { return pixels_.size(); }
  [[nodiscard]] bool contains(int u, int v) const {
    return u >= 0 && v >= 0 && u < width_ && v < height_;
  }
  template <typename S>
  [[nodiscard]] bool same_size(const Image<S>& other) const {
    return width_ == other.width() && height_ == other.height();
  }

  [[nodiscard]] T& at(int u, int v) { return pixels_[offset(u, v)]; }
  [[nodiscard]] const T& at(int u, int v) const { return pixels_[offset(u, v)]; }
  [[nodiscard]] T* row(int v) { return pixels_.data() + offset(0, v); }
  [[nodiscard]] const T* row(int v) const { return pixels_.data() + offset(0, v); }
  [[nodiscard]] T* data() { return pixels_.data(); }
  [[nodiscard]] const T* data() const { return pixels_.data(); }
  [[nodiscard]] auto begin() { return pixels_.begin(); }
  [[nodiscard]] auto end() { return pixels_.end(); }
  [[nodiscard]] auto begin() const { return pixels_.begin(); }
  [[nodiscard]] auto end() const { return pixels_.end(); }

 private:
  [[nodiscard]] std::size_t offset(int u, int v) const {
    return static_cast<std::size_t>(v) * width_ + u;
  }
  int width_ = 0;
  int height_ = 0;
  std::vector<T> pixels_;
};

using GreyImage = Image<std::uint8_t>;
using ColourImage = Image<Rgb8>;
using DepthImage = Image<float>;  ///< metres along the optical axis, 0 = none

}  // namespace ygslam
