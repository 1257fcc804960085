// Rendered pictures and warps with exact truth, for benchmarks and for learning.
#pragma once

#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/rng.hpp"
#include "image/image.hpp"

namespace ygslam::bench {

/// A grey picture of overlapping shapes and texture of several scales, the same for the same seed.
[[nodiscard]] GreyImage render_texture(int width, int height, unsigned seed);

/// A change of view and light.
struct Warp {
  Eigen::Matrix3d H = Eigen::Matrix3d::Identity();  ///< homography, first pixel to second pixel
  double gain = 1, offset = 0, noise = 0;           ///< of the grey values; noise: sigma

  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& uv_px) const {
    return (H * uv_px.homogeneous()).hnormalized();
  }
};

/// @param kind translation, rotation, scale, perspective, light or noise; each also moves a little
/// in all the other ways but light.
[[nodiscard]] Warp make_warp(const std::string& kind, int width, int height, Rng& rng);
[[nodiscard]] GreyImage apply_warp(const GreyImage& image, const Warp& warp, Rng& rng);

}  // namespace ygslam::bench
