// Rotations of a path whose turns a gyroscope knows. From one frame to the next it errs by a
// fraction of what a pose errs by, but what it errs by adds up; a pose's errors do not. Both
// together by least squares (fixed-interval smoothing: Rauch, Tung and Striebel 1965), as a chain
// of small corrections.
#pragma once

#include <span>
#include <vector>

#include "core/time.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

/// What a pose errs by lasts for some frames: as white noise of each it counts so many times as
/// much. 3 to 8 do alike (bench/turns.py).
inline constexpr double kLastingFactor = 5;
inline constexpr double kLeastTurnStd_rad = 1e-4;  ///< no pose's rotation is better

struct TurningPose {
  Timestamp stamp;
  SE3 T_world_camera;
  double std_rad = 0;  ///< of its rotation about one axis, as its points tell
  /// How far the points are away that it was found by: a rotation that is wrong looks like a shift
  /// of the camera at this distance, and was made up for by one; 0: it was not.
  double distance_m = 0;
  /// How the camera turned since the pose before, R_before_here = so3_exp(turn_rad), by a
  /// gyroscope as it was read: with its bias.
  Vec3 turn_rad = Vec3::Zero();
  double turn_std_rad = 0;  ///< about one axis; 0: nobody knows the turn
};

/// Poses in order of time, each with its rotation held by those about it, and shifted by what its
/// rotation had been made up for with. Poses that fit badly count less. Where no turn is known the
/// chain ends, and where it has few poses, or tells of other motions, nothing is changed.
[[nodiscard]] std::vector<SE3> smooth_turns(std::span<const TurningPose> path);

/// TurningPose::distance_m of a pose. @param covariance of the twist xi of exp(xi) T_camera_world.
[[nodiscard]] double distance_of_points(const Mat6& covariance);

}  // namespace ygslam
