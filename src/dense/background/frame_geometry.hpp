// Where a recorded image, with its lens and its shutter, shows points of the world.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "geometry/camera.hpp"
#include "geometry/rolling_shutter.hpp"

namespace ygslam {

/// One frame's colour image, its depth registered to it. The camera must live longer.
class FrameGeometry {
 public:
  /// @param T_world_camera at the frame's middle instant.
  FrameGeometry(const Camera& camera, const SE3& T_world_camera, const ReadOut& read_out);

  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] const SE3& T_world_camera() const { return T_world_camera_; }

  struct Seen {
    Eigen::Vector2f uv_px = Eigen::Vector2f::Zero();  ///< recorded pixel, may lie outside
    float z_m = 0;  ///< along the optical axis at the instant it was seen
  };
  /// @return nothing for a point behind the camera or less than 5 cm in front.
  [[nodiscard]] std::optional<Seen> project(const Eigen::Vector3f& p_world) const;
  /// The world's point at a recorded pixel's depth.
  [[nodiscard]] Eigen::Vector3f unproject(int u, int v, float z_m) const;

 private:
  struct RowPose {
    Eigen::Matrix3f R_world_camera;
    Eigen::Vector3f t_world_camera;
  };
  [[nodiscard]] const RowPose& row(float v) const;
  [[nodiscard]] Eigen::Vector3f in_camera(const RowPose& pose,
                                          const Eigen::Vector3f& p_world) const {
    return pose.R_world_camera.transpose() * (p_world - pose.t_world_camera);
  }
  [[nodiscard]] Eigen::Vector2f pixel(const Eigen::Vector3f& p_camera) const;

  const Camera& camera_;
  SE3 T_world_camera_;
  std::vector<RowPose> rows_;  // one for all where they are read at once
};

}  // namespace ygslam
