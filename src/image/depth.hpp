// The one place that turns raw sensor depth into metres and knows the sensor's noise.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "image/image.hpp"

namespace ygslam {

struct DepthConfig {
  double min_m = 0.3;  ///< nearer is taken as none
  double max_m = 8.0;  ///< farther is taken as none
};

/// @param raw 16-bit sensor values, 0 = none. @param scale units per metre, > 0.
[[nodiscard]] DepthImage depth_from_raw(const Image<std::uint16_t>& raw, double scale,
                                        const DepthConfig& config);

/// Whether the samples were written with their bytes the other way round: the low byte of a depth
/// changes from pixel to pixel and the high one hardly does, so that neighbours jump by 256s and
/// are alike when swapped. A sample of the rows decides; images with few different depths never
/// are.
[[nodiscard]] bool has_swapped_bytes(const Image<std::uint16_t>& raw);

/// What a sensor of that scale would have delivered: rounded, 0 where there is none or where 16
/// bits do not hold it.
[[nodiscard]] Image<std::uint16_t> raw_from_depth(const DepthImage& depth_m, double scale);

/// Copy of a float depth image [m] in which NaN, infinite, negative and out-of-range values are 0.
[[nodiscard]] DepthImage sanitized_depth(const DepthImage& depth_m, const DepthConfig& config);

/// Depth at a (sub-)pixel: the nearest pixel's, unless its 3x3 neighbourhood straddles an edge or a
/// hole, in which case the nearer surface wins. @return 0 if there is none.
[[nodiscard]] float depth_at(const DepthImage& depth_m, double u, double v);

/// The depths [m] seen around a pixel: at the edge of an object the sensor's depth may be off by a
/// few pixels, and what is seen there belongs to either surface. Both 0 = none.
struct DepthRange {
  float min_m = 0;
  float max_m = 0;
};

/// Nearest and farthest depth in the square of half side radius_px about a pixel, which may lie
/// outside the image. Values that are not finite count as none.
[[nodiscard]] DepthRange depth_range(const DepthImage& depth_m, int u, int v, int radius_px);

/// Whether surfaces at different depths meet within radius_px of a pixel. Judged in inverse depth,
/// in which a plane is an affine function of the pixel and a Kinect's noise hardly depends on the
/// range. Directions with a hole say nothing.
/// @param depth_at_m depth_at() of the pixel, > 0.
[[nodiscard]] bool on_depth_edge(const DepthImage& depth_m, double u, double v, double depth_at_m,
                                 double radius_px);

/// Depth at a (sub-)pixel about which a plane is seen, of all depths within 6 px together: several
/// times more precise than a single one. Inverse depth is an affine function of the pixel on a
/// plane, so that two pixels on opposite sides have the centre's in their mean.
/// @return in whole 0.2 mm; 0 where holes, edges or a bend leave no plane.
[[nodiscard]] float plane_depth_at(const DepthImage& depth_m, double u, double v);

struct SurfaceDepth {
  float depth_m = 0;      ///< 0 = none
  bool on_plane = false;  ///< whether it is that of a plane, else of the pixel alone
};

/// Depth at a (sub-)pixel: plane_depth_at() where there is one, else depth_at(). An empty image has
/// none.
[[nodiscard]] SurfaceDepth surface_depth_at(const DepthImage& depth_m, double u, double v);

/// Change of depth per pixel to the right and down [m/px], from the depths 4 px away on both sides;
/// 0 where one of them is missing or lies on another surface.
[[nodiscard]] Eigen::Vector2f depth_slope(const DepthImage& depth_m, double u, double v);

/// Standard deviation of a Kinect's depth [m] (Nguyen, Izadi, Lovell 2012, axial noise).
[[nodiscard]] constexpr double kinect_depth_sigma_m(double depth_m) {
  return 0.0012 + 0.0019 * (depth_m - 0.4) * (depth_m - 0.4);
}

}  // namespace ygslam
