#include "system/held_pose.hpp"

#include <cmath>
#include <utility>

#include "system/pose_covariance.hpp"

namespace ygslam {
namespace {

/// What a bias is off by adds up over as many frames as the filter remembers: as noise of each it
/// counts so many times as much.
constexpr double kBiasMemory = 7;

}  // namespace

std::optional<CameraTurn> HeldPose::take(Timestamp stamp, const InertialEstimator& imu,
                                         TrackResult& result) {
  std::optional<CameraTurn> turn;
  std::optional<HeldTurn> held;
  if (has_pose(result.state)) {
    const auto before = std::exchange(posed_, stamp);
    if (before) turn = imu.turn(*before, stamp);
    if (turn) held = held_turn(*turn, seconds_between(stamp, *before), imu);
  }
  if (!is_seen(result.state) || !result.covariance || !result.T_odom_camera.is_finite()) {
    filter_.restart();
    return turn;
  }
  const double factor = result.state == TrackState::kWeak ? kWeakStdFactor : 1;
  const SE3 T_points_held =
      filter_.step(result.T_odom_camera, factor * factor * *result.covariance, held);
  result.T_odom_camera = result.T_odom_camera * T_points_held;
  result.T_world_camera = result.T_world_camera * T_points_held;
  return turn;
}

std::optional<HeldTurn> HeldPose::held_turn(const CameraTurn& turn, double step_s,
                                            const InertialEstimator& imu) const {
  const auto known = imu.state();
  if (!known) return std::nullopt;
  const double bias_std = std::sqrt(
      known->covariance.block<3, 3>(state_part::kGyroBias, state_part::kGyroBias).trace() / 3);
  return HeldTurn{turn.turn_rad - step_s * (R_camera_imu_ * known->state.bias.gyro_radps),
                  std::hypot(turn.std_rad, kBiasMemory * step_s * bias_std)};
}

}  // namespace ygslam
