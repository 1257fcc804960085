// Depth of a camera of its own, as the colour camera would see it.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "geometry/camera.hpp"
#include "image/image.hpp"

namespace ygslam {

/// The camera that takes the depth images, where that is not the colour camera.
struct DepthCamera {
  CameraConfig camera;  ///< complete, width and height included; no shutter
  SE3 T_colour_depth;   ///< from its optical frame to that of the colour camera
};

/// Brings depth images to the pixels of the colour camera: every pixel is taken as a small piece of
/// surface across the line of sight, moved, and drawn with a depth buffer as the upright box about
/// its corners. Where the colour camera sees what the depth camera does not, there is no depth.
class DepthRegistration {
 public:
  /// @param colour complete, width and height included.
  DepthRegistration(const DepthCamera& depth, const CameraConfig& colour);

  /// Of the images that registered() takes.
  [[nodiscard]] const CameraConfig& depth_camera() const { return depth_; }
  /// From camera to camera.
  [[nodiscard]] double baseline_m() const { return t_colour_depth_m_.norm(); }
  /// @param depth_m of the depth camera's size, 0 = none. May be called from several threads.
  /// @return of the colour camera's size, along its optical axis.
  [[nodiscard]] DepthImage registered(const DepthImage& depth_m) const;

 private:
  struct Row;
  struct Box {
    Eigen::Vector2f low_px, high_px;
  };
  /// Where the upper left corners of a row's pixels fall, each at its own depth.
  void place_row(const DepthImage& depth_m, int v, Row& row) const;
  /// What a pixel's piece of surface covers; nothing where it is not seen.
  [[nodiscard]] std::optional<Box> box_of(const Row& row, const Row& below, int u, int v) const;
  void draw_row(const Row& row, const Row& below, int v, DepthImage& out) const;
  /// @param corner of the pixel grid. @return the colour pixel, far outside where there is none.
  [[nodiscard]] Eigen::Vector2f project(int corner_u, int corner_v, float depth_m) const;
  [[nodiscard]] std::size_t corner(int u, int v) const {
    return static_cast<std::size_t>(v) * (static_cast<std::size_t>(depth_.width) + 1) +
           static_cast<std::size_t>(u);
  }

  CameraConfig depth_;
  Camera colour_;
  std::vector<Eigen::Vector3f> rays_colour_;  // of the corners of pixels, at 1 m, in colour axes
  Eigen::Vector3f t_colour_depth_m_;
  Eigen::Vector2f focal_px_, centre_px_;  // of the colour camera
  bool is_distorted_;                     // the same
  bool is_upright_;  // rows stay rows: two opposite corners of a pixel span its box
  Eigen::Vector2f low_px_, high_px_;  // ideal pixels whose pieces may reach into the image
};

/// Null where both cameras are one and the same: then depth is registered as it is.
[[nodiscard]] std::shared_ptr<const DepthRegistration> depth_registration(
    const DepthCamera& depth, const CameraConfig& colour);

}  // namespace ygslam
