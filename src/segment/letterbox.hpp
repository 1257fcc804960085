// How an image of any size is fitted into the network's input, and the way back. A border is grey
// 114, with Ultralytics as with MMDetection.
#pragma once

#include <cstdint>

#include "image/image.hpp"

namespace ygslam {

/// Continuous image coordinates: pixel (u, v) covers [u, u + 1) x [v, v + 1).
struct EdgePoint {
  double x = 0, y = 0;
};

enum class Placement {
  kCentred,    ///< same scale both ways, border on both sides (Ultralytics)
  kTopLeft,    ///< same scale both ways, border on the right or below (MMDetection)
  kStretched,  ///< fills the input (rfdetr)
};

/// Placement of an image inside the network's input. Sizes in pixels, all > 0.
struct Letterbox {
  int image_width = 0, image_height = 0;
  int net_width = 0, net_height = 0;
  int inner_width = 0, inner_height = 0;  ///< size of the scaled image inside the input
  int pad_left = 0, pad_top = 0;

  /// Network pixels per image pixel. Also where the aspect ratio is kept the two differ a little:
  /// inner sizes are whole pixels.
  [[nodiscard]] double scale_x() const { return static_cast<double>(inner_width) / image_width; }
  [[nodiscard]] double scale_y() const { return static_cast<double>(inner_height) / image_height; }
  /// True where image and input have the same size, so that nothing is resampled.
  [[nodiscard]] bool identity() const {
    return image_width == net_width && image_height == net_height;
  }
  [[nodiscard]] EdgePoint to_network(EdgePoint image_px) const {
    return {image_px.x * scale_x() + pad_left, image_px.y * scale_y() + pad_top};
  }
  /// Exact inverse of to_network.
  [[nodiscard]] EdgePoint to_image(EdgePoint net_px) const {
    return {(net_px.x - pad_left) / scale_x(), (net_px.y - pad_top) / scale_y()};
  }
};

inline constexpr std::uint8_t kLetterboxGrey = 114;

/// The largest there is. All sizes must be > 0.
[[nodiscard]] Letterbox make_letterbox(int image_width, int image_height, int net_width,
                                       int net_height, Placement placement = Placement::kCentred);

/// The network's view of the image: bilinear, border grey. `image` must have the letterbox's size.
[[nodiscard]] ColourImage letterboxed(const ColourImage& image, const Letterbox& box);

}  // namespace ygslam
