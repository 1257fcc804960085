// The sum of the motions from frame to frame: a frame that drifts but never jumps (odom of ROS REP
// 105), and where it lies in the world.
#pragma once

#include <optional>

#include "geometry/se3.hpp"

namespace ygslam {

class Odometry {
 public:
  /// @param T_now_last motion of the camera since its last frame with a pose.
  void move(const SE3& T_now_last) {
    T_odom_camera_ = (T_odom_camera_ * T_now_last.inverse()).normalized();
  }

  /// Where an IMU says that the camera is.
  void place_at(const SE3& T_odom_camera) { T_odom_camera_ = T_odom_camera; }

  struct Place {
    SE3 T_world_odom;
    double correction_m = 0;  ///< how far a change of T_world_odom moved the camera
    bool provisional = false;
  };
  /// Where the camera is in the world, after move().
  /// @param sees_known_ground what it sees was in the map before doubt().
  [[nodiscard]] Place place(const SE3& T_world_camera, bool sees_known_ground);

  /// The camera was found by what it sees alone. Its place is provisional until it sees known
  /// ground so far from there that no room which looks like another can be meant.
  void doubt() { doubtful_since_ = T_odom_camera_.t(); }
  [[nodiscard]] bool is_doubtful() const { return doubtful_since_.has_value(); }

  [[nodiscard]] const SE3& T_odom_camera() const { return T_odom_camera_; }

 private:
  SE3 T_odom_camera_;
  std::optional<SE3> T_world_odom_;
  std::optional<Vec3> doubtful_since_;  // the place, in odom
};

}  // namespace ygslam
