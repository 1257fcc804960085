// An upright box in an image.
#pragma once

#include <algorithm>

namespace ygslam {

/// Edges in pixels; empty unless x1 > x0 and y1 > y0.
struct PixelBox {
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  [[nodiscard]] bool empty() const { return !(x1 > x0 && y1 > y0); }
  [[nodiscard]] float width() const { return x1 - x0; }
  [[nodiscard]] float height() const { return y1 - y0; }
  [[nodiscard]] float area() const { return empty() ? 0.0F : width() * height(); }
  /// What both cover.
  [[nodiscard]] PixelBox operator&(const PixelBox& o) const {
    return {std::max(x0, o.x0), std::max(y0, o.y0), std::min(x1, o.x1), std::min(y1, o.y1)};
  }
  /// The least box about both.
  [[nodiscard]] PixelBox operator|(const PixelBox& o) const {
    return {std::min(x0, o.x0), std::min(y0, o.y0), std::max(x1, o.x1), std::max(y1, o.y1)};
  }
};

/// Intersection over union; 0 of empty ones.
[[nodiscard]] inline double iou(const PixelBox& a, const PixelBox& b) {
  const double both = (a & b).area();
  return both > 0 ? both / (a.area() + b.area() - both) : 0;
}

}  // namespace ygslam
