// Gravity as an IMU measured it in keyframes: it fixes roll and pitch wherever poses are adjusted.
// And how to be rid of it.
#pragma once

#include <map>

#include "map/map.hpp"
#include "map/messages.hpp"
#include "optim/direction.hpp"

namespace ygslam {

/// Of the keyframes that have it, ready for an adjustment but for the index of the pose. Where
/// gravity pulls in the world nobody knows beforehand: all keyframes of a submap say it together.
/// What disagrees with the others counts less. Empty without an IMU.
[[nodiscard]] std::map<KeyframeId, MeasuredDirection> measured_gravity(const Map& map);

/// Gravity and turns go out of the keyframes that were told them. @return whether there were any.
bool forget_imu(Map& map, const ImuRetraction& retraction);

}  // namespace ygslam
