// Pictures for the tests of this folder.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/rng.hpp"
#include "features/feature.hpp"
#include "features/scale_space.hpp"
#include "image/image.hpp"

namespace ygslam::testing {

/// A picture defined everywhere in the plane, so that it can be seen from any view: discs of random
/// size and grey value over each other. Edges are half a pixel soft.
class DiscWorld {
 public:
  explicit DiscWorld(std::uint64_t seed, int discs = 1000, double extent_px = 420) {
    Rng rng(seed);
    for (int i = 0; i < discs; ++i) {
      discs_.push_back({rng.uniform(-extent_px, extent_px), rng.uniform(-extent_px, extent_px),
                        rng.uniform(5, 40), rng.uniform(20, 235), rng.uniform(-1, 1)});
    }
  }
  /// The view with its centre on the origin, turned by angle_rad and magnified by scale.
  [[nodiscard]] GreyImage view(int width, int height, double angle_rad = 0, double scale = 1,
                               double gain = 1, double offset = 0) const {
    GreyImage image(width, height);
    const double c = std::cos(angle_rad) / scale;
    const double s = std::sin(angle_rad) / scale;
    for (int v = 0; v < height; ++v) {
      const double y = v - 0.5 * height;
      std::vector<Disc> near;  // those the row passes through
      for (const Disc& d : discs_) {
        if (std::abs(d.x * s + d.y * c - y / (scale * scale)) * scale < d.radius + 2) {
          near.push_back(d);
        }
      }
      for (int u = 0; u < width; ++u) {
        const double x = u - 0.5 * width;
        const double grey = gain * grey_at(near, c * x + s * y, -s * x + c * y) + offset;
        image.at(u, v) = static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L));
      }
    }
    return image;
  }
  /// Where a pixel of the plain view lies in the view turned by angle_rad and magnified by scale.
  [[nodiscard]] static Eigen::Vector2f moved(const Eigen::Vector2f& uv_px, int width, int height,
                                             double angle_rad, double scale) {
    const Eigen::Vector2d centre(0.5 * width, 0.5 * height);
    const Eigen::Vector2d d = uv_px.cast<double>() - centre;
    const double c = std::cos(angle_rad) * scale;
    const double s = std::sin(angle_rad) * scale;
    return (centre + Eigen::Vector2d(c * d.x() - s * d.y(), s * d.x() + c * d.y())).cast<float>();
  }

 private:
  struct Disc {
    double x, y, radius, grey, tilt;
  };
  static double grey_at(const std::vector<Disc>& discs, double x, double y) {
    double grey = 128;
    for (const Disc& d : discs) {
      const double dx = x - d.x;
      const double dy = y - d.y;
      if (std::abs(dx) > d.radius + 1 || std::abs(dy) > d.radius + 1) continue;
      // Cut by a straight edge through the centre: two sharp corners.
      const double inside = std::min(d.radius - std::hypot(dx, dy), dx + d.tilt * dy);
      grey += std::clamp(inside + 0.5, 0.0, 1.0) * (d.grey - grey);
    }
    return grey;
  }
  std::vector<Disc> discs_;
};

inline GreyImage noise_image(int width, int height, std::uint64_t seed, int amplitude = 255) {
  Rng rng(seed);
  GreyImage image(width, height);
  for (std::uint8_t& p : image) {
    p = static_cast<std::uint8_t>(rng.below(static_cast<std::uint32_t>(amplitude) + 1));
  }
  return image;
}

inline PaddedImage padded(const GreyImage& image) {
  PaddedImage result;
  result.assign(image, kLevelBorder_px);
  return result;
}

inline Descriptor random_descriptor(Rng& rng) {
  return {{rng.next(), rng.next(), rng.next(), rng.next()}};
}

}  // namespace ygslam::testing
