// A map that was never closed by a loop, straightened by what a gyroscope measured while it was
// made: vision's heading walks off, here and there by much at once, a gyroscope's bias hardly
// changes.
#pragma once

#include <atomic>
#include <optional>

#include "map/map.hpp"
#include "map/map_patch.hpp"

namespace ygslam {

/// Minus the bias that is left in each MeasuredTurn [rad/s, the camera's axes]: what they turn
/// beyond the map, where the few turns that are wrong count little.
/// @return nullopt where the keyframes tell too little, and where it is larger than any sensor's.
[[nodiscard]] std::optional<Vec3> left_gyro_bias(const Map& map);

/// Most rooms are smaller: there what is seen again holds the map better than a gyroscope does.
inline constexpr double kLargerThanARoom_m = 20;

/// Keyframes turned as gyroscope and gravity say where they know better than what ties the map
/// together; ways between neighbours stay.
/// @param min_shared see make_map_graph(). @return nullopt without an IMU, where no keyframe lies
/// farther than `least_extent_m` from its submap's first one, where nothing fits better, and where
/// it is given up. @param abort set by another thread or a signal to give up.
[[nodiscard]] std::optional<MapPatch> straightened(const Map& map, int min_shared,
                                                   double least_extent_m = kLargerThanARoom_m,
                                                   const std::atomic<bool>* abort = nullptr);

}  // namespace ygslam
