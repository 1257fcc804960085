// The pose of the moment, held by a gyroscope. From frame to frame it errs by a tenth of what a
// pose errs by; what it errs by adds up, a pose's errors do not: a Kalman filter of what vision's
// rotation is off by. smooth_turns() does the same once all frames are known.
#pragma once

#include <optional>

#include "core/time.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

/// How the camera turned since the frame before, without the gyroscope's bias.
struct HeldTurn {
  Vec3 turn_rad = Vec3::Zero();  ///< R_before_here = so3_exp(turn_rad)
  double std_rad = 0;            ///< about one axis
};

class TurnFilter {
 public:
  /// Every frame with a pose in turn, as its points tell it.
  /// @param covariance of the twist xi of exp(xi) T_camera_odom. Not positive: of no use.
  /// @param turn nullopt: nobody knows. Then the points alone count, as they do after restart().
  /// @return T_points_held: where the camera is, in the camera as its points tell it.
  [[nodiscard]] SE3 step(const SE3& T_odom_camera, const Mat6& covariance,
                         const std::optional<HeldTurn>& turn);
  /// The next pose does not go on from the last one.
  void restart() { last_.reset(); }

 private:
  struct Last {
    Mat3 R_odom_points;
    Vec3 off_rad;     // R_odom_held = R_odom_points so3_exp(off_rad)
    Mat3 covariance;  // of R_odom_held, in the camera's axes
  };
  std::optional<Last> last_;
};

}  // namespace ygslam
