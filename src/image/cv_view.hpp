// OpenCV headers over our pixels, nothing copied. Include from .cpp files only.
#pragma once

#include <opencv2/core/mat.hpp>

#include "image/image.hpp"

namespace ygslam {

namespace detail {
template <typename T>
inline constexpr int kCvType = -1;
template <>
inline constexpr int kCvType<std::uint8_t> = CV_8UC1;
template <>
inline constexpr int kCvType<std::uint16_t> = CV_16UC1;
template <>
inline constexpr int kCvType<float> = CV_32FC1;
template <>
inline constexpr int kCvType<Rgb8> =
    CV_8UC3;  ///< channel order r, g, b (OpenCV's default is b, g, r)
}  // namespace detail

/// A header that shares the image's pixels; valid as long as the image.
template <typename T>
[[nodiscard]] cv::Mat cv_view(Image<T>& image) {
  return {image.height(), image.width(), detail::kCvType<T>, image.data()};
}
/// The same for reading: OpenCV has no const header, so do not write through it.
template <typename T>
[[nodiscard]] cv::Mat cv_view(const Image<T>& image) {
  return {image.height(), image.width(), detail::kCvType<T>, const_cast<T*>(image.data())};
}

}  // namespace ygslam
