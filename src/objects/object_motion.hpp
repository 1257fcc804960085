// Where somebody is, how fast he goes and where he will be, with covariance. Any frame whose axes
// do not turn: what is assumed about motion is the same in all directions.
#pragma once

#include "geometry/se3.hpp"

namespace ygslam {

struct ObjectMotion {
  Vec3 position_m = Vec3::Zero();  ///< middle of a person; of other things, of what is seen
  Vec3 velocity_mps = Vec3::Zero();
  Mat6 covariance = Mat6::Zero();  ///< of position, then velocity [m, m/s]

  /// So much later: people go on, turn and stop.
  [[nodiscard]] ObjectMotion after(double seconds) const;
  [[nodiscard]] ObjectMotion seen_from(const SE3& T_target_source) const;
};

/// Kalman filter of constant velocity.
class MotionFilter {
 public:
  [[nodiscard]] bool has_begun() const { return has_begun_; }
  /// @param hidden nobody sees it: its speed fades.
  void predict(double seconds, bool hidden);
  void update(const Vec3& position_m);
  void update_velocity(const Vec3& velocity_mps);
  /// Once it has begun. With the error that no filter sees: where in a body its seen side is.
  [[nodiscard]] ObjectMotion motion() const;

 private:
  bool has_begun_ = false;
  ObjectMotion state_;
};

}  // namespace ygslam
