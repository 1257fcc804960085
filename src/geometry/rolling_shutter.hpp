// A camera whose rows are read one after the other while it moves. Over one frame its velocity is
// taken as constant: with t = 0 at the middle row of the colour image,
//   T_world_camera(t) = T_world_camera(0) exp(t velocity)
// (Ringaby and Forssen 2011; Kerl et al. 2015 with a spline), so that a fixed point seen at t lies
// at p_middle = exp(t velocity) p(t) in the camera as it is at the frame's middle instant. All
// geometry works on points of that instant.
#pragma once

#include "geometry/camera.hpp"

namespace ygslam {

/// When the rows of a frame are read; see CameraConfig.
struct ShutterTimes {
  double colour_readout_s = 0;
  double depth_readout_s = 0;
  double depth_delay_s = 0;

  [[nodiscard]] bool is_global() const {
    return colour_readout_s == 0 && depth_readout_s == 0 && depth_delay_s == 0;
  }
};
[[nodiscard]] ShutterTimes shutter_times(const CameraConfig& camera);

/// How a frame came about.
struct ReadOut {
  ShutterTimes times;
  /// Of the camera: twist per second in its own frame at the middle instant.
  Vec6 body_velocity = Vec6::Zero();
};

class RollingShutter {
 public:
  RollingShutter(int image_height, const ReadOut& read_out);

  /// False if every pixel is as it would be at the middle instant.
  [[nodiscard]] bool is_rolling() const { return rolling_; }
  /// Whether a pixel's depth was seen at another time than its colour.
  [[nodiscard]] bool depth_has_own_time() const { return depth_has_own_time_; }
  /// When a row of the recorded image was seen [s].
  [[nodiscard]] double colour_time_s(double row_px) const {
    return (row_px + 0.5 - middle_px_) * colour_row_s_;
  }
  [[nodiscard]] double depth_time_s(double row_px) const {
    return depth_delay_s_ + (row_px + 0.5 - middle_px_) * depth_row_s_;
  }
  /// A fixed point in the camera at one instant, in the camera as it is `dt_s` earlier.
  [[nodiscard]] Vec3 earlier(const Vec3& p_cam, double dt_s) const;
  /// A point seen in a row of the colour image, in the camera at the middle instant.
  [[nodiscard]] Vec3 to_middle(const Vec3& p_cam, double row_px) const {
    return earlier(p_cam, colour_time_s(row_px));
  }
  /// The inverse.
  [[nodiscard]] Vec3 to_row(const Vec3& p_middle, double row_px) const {
    return earlier(p_middle, -colour_time_s(row_px));
  }
  /// Where the colour image shows a point of the middle instant.
  /// @return recorded pixel.
  [[nodiscard]] Vec2 seen_at(const Camera& camera, const Vec3& p_middle) const;

 private:
  Vec6 velocity_;
  Vec3 rotation_of_v_, rotated_twice_v_;  // w x v and w x (w x v), where velocity_ is (v, w)
  double middle_px_;
  double colour_row_s_, depth_row_s_, depth_delay_s_;
  bool rolling_, depth_has_own_time_;
};

}  // namespace ygslam
