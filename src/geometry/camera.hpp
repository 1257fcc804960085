// The pinhole camera with Brown-Conrady distortion (k1 k2 p1 p2 k3, as in OpenCV and TUM).
//
// Two kinds of pixel: `uv_px` where a point lies in the recorded (distorted) image, and `ideal_px`
// where the same ray would lie without distortion. Geometry works on ideal pixels.
// A pixel's centre has integer coordinates.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "geometry/se3.hpp"

namespace ygslam {

/// Pixels [u, u + width) x [v, v + height) of the recorded image.
struct PixelRectangle {
  int u = 0, v = 0, width = 0, height = 0;
  bool operator==(const PixelRectangle&) const = default;
};

struct CameraConfig {
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< [px]
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  int width = 640, height = 480;  ///< [px]
  double depth_scale = 5000;      ///< raw depth units per metre
  // When the rows are read (geometry/rolling_shutter.hpp). 0 = all at once; < 0 = last row first.
  double colour_readout_ms = 0;  ///< of all rows of the colour image
  double depth_readout_ms = 0;   ///< of all rows of the depth image
  double depth_delay_ms = 0;     ///< middle row of the depth image after that of the colour image
  bool shutter_known = false;    ///< somebody said so; else these are a guess
  // Of the device that it may be: taken where the three times above say nothing and the pictures
  // show that rows are read one after the other. 0 = nothing is suspected.
  double suspected_colour_readout_ms = 0;
  double suspected_depth_readout_ms = 0;
  /// Not of the world: the robot itself, text laid over the image. May overlap.
  std::vector<PixelRectangle> ignored{};

  [[nodiscard]] bool is_distorted() const {
    return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0;
  }
};

/// A pixel of the image's border that no ray falls on, because the distortion folds the image on
/// the way there; nothing if the distortion can be undone everywhere.
[[nodiscard]] std::optional<Vec2> pixel_without_ray(const CameraConfig& config);

class Camera {
 public:
  /// @param config one without pixel_without_ray(); a pixel that has none gets the nearest ray.
  explicit Camera(const CameraConfig& config);

  [[nodiscard]] const CameraConfig& config() const { return config_; }
  [[nodiscard]] int width() const { return config_.width; }
  [[nodiscard]] int height() const { return config_.height; }
  [[nodiscard]] double fx() const { return config_.fx; }
  [[nodiscard]] double fy() const { return config_.fy; }
  [[nodiscard]] double cx() const { return config_.cx; }
  [[nodiscard]] double cy() const { return config_.cy; }

  /// @param p_cam point in the camera frame [m], z > 0. @return ideal pixel.
  [[nodiscard]] Vec2 project(const Vec3& p_cam) const {
    const double inverse_z = 1.0 / p_cam.z();
    return {config_.fx * p_cam.x() * inverse_z + config_.cx,
            config_.fy * p_cam.y() * inverse_z + config_.cy};
  }
  /// @return the point in the camera frame [m] at depth_m along the optical axis.
  [[nodiscard]] Vec3 unproject(const Vec2& ideal_px, double depth_m) const {
    return {(ideal_px.x() - config_.cx) / config_.fx * depth_m,
            (ideal_px.y() - config_.cy) / config_.fy * depth_m, depth_m};
  }
  /// Recorded pixel to ideal pixel; right to the 1e-4 px of a float at pixel centres, interpolated
  /// between them.
  [[nodiscard]] Vec2 undistort(const Vec2& uv_px) const;
  /// The same of a whole pixel in the image, in less time.
  [[nodiscard]] Vec2 undistort_pixel(int u, int v) const {
    if (undistorted_.empty()) return {u, v};
    return undistorted_[static_cast<std::size_t>(v) * config_.width + u].cast<double>();
  }
  /// Ideal pixel to recorded pixel.
  [[nodiscard]] Vec2 distort(const Vec2& ideal_px) const;
  /// Smallest box of ideal pixels that holds the whole image: {min_x, min_y, max_x, max_y}.
  [[nodiscard]] const std::array<double, 4>& ideal_bounds() const { return ideal_bounds_; }
  /// True if the ideal pixel lies in ideal_bounds().
  [[nodiscard]] bool sees(const Vec2& ideal_px) const {
    const auto& [min_x, min_y, max_x, max_y] = ideal_bounds_;
    return ideal_px.x() >= min_x && ideal_px.y() >= min_y && ideal_px.x() <= max_x &&
           ideal_px.y() <= max_y;
  }
  /// True if the recorded pixel lies in the image, at least margin_px from its border.
  [[nodiscard]] bool contains(const Vec2& uv_px, double margin_px = 0) const {
    return uv_px.x() >= margin_px && uv_px.y() >= margin_px &&
           uv_px.x() <= config_.width - 1 - margin_px &&
           uv_px.y() <= config_.height - 1 - margin_px;
  }

 private:
  [[nodiscard]] Vec2 undistort_exact(const Vec2& uv_px) const;

  CameraConfig config_;
  std::vector<Eigen::Vector2f> undistorted_;  // ideal pixel of every recorded pixel; empty if none
  std::array<double, 4> ideal_bounds_{};
};

}  // namespace ygslam
