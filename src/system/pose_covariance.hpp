// How certain a frame's pose is, for those who fuse it with other sensors.
#pragma once

#include "tracking/track_result.hpp"

namespace ygslam {

/// Stands for no knowledge at all, as m2 and rad2.
inline constexpr double kUnknownVariance = 1e6;

[[nodiscard]] inline Mat6 with_doubt(Mat6 covariance, const Doubt& doubt) {
  if (covariance(0, 0) >= kUnknownVariance) return covariance;
  covariance.diagonal().head<3>().array() += doubt.position_m2;
  covariance.diagonal().tail<3>().array() += doubt.rotation_rad2;
  return covariance;
}

/// Of T_odom_camera against the ground that it sees, while coasting against where that began: x, y,
/// z, then rotations about the same axes [m, rad]. Two frames' difference has the sum of both, and
/// of what lies between them (bench/nees.py). All 0 of a run's first frame, which is the origin
/// itself; kUnknownVariance while there is no pose, or none of its information.
/// @param R_axes_odom turns odom into the axes that are wanted.
[[nodiscard]] inline Mat6 seen_covariance(const TrackResult& result,
                                          const Mat3& R_axes_odom = Mat3::Identity()) {
  const bool has_pose = ygslam::has_pose(result.state);
  const bool is_first = result.state == TrackState::kTracking && result.matches == 0;
  if (has_pose && !result.covariance && is_first) return Mat6::Zero();
  if (!has_pose || !result.covariance) return kUnknownVariance * Mat6::Identity();
  const Mat3 R = R_axes_odom * result.T_odom_camera.R();
  Mat6 rotation = Mat6::Zero();
  rotation.topLeftCorner<3, 3>() = rotation.bottomRightCorner<3, 3>() = R;
  const double factor = result.state == TrackState::kWeak ? kWeakStdFactor : 1;
  return factor * factor * rotation * *result.covariance * rotation.transpose();
}

/// The same with what odom has drifted since the run began.
[[nodiscard]] inline Mat6 odom_covariance(const TrackResult& result,
                                          const Mat3& R_axes_odom = Mat3::Identity()) {
  return with_doubt(seen_covariance(result, R_axes_odom), result.doubt.odom);
}

/// Of T_world_camera, in the world's axes: with what the map has drifted to where the camera is.
/// kUnknownVariance in a submap that is not joined to the world.
[[nodiscard]] inline Mat6 map_covariance(const TrackResult& result,
                                         const Mat3& R_axes_world = Mat3::Identity()) {
  if (result.unplaced) return kUnknownVariance * Mat6::Identity();
  return with_doubt(seen_covariance(result, R_axes_world * result.T_world_odom.R()),
                    result.doubt.map);
}

}  // namespace ygslam
