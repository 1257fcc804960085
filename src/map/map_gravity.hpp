// Gravity as an IMU measured it in keyframes: it fixes roll and pitch wherever poses are adjusted.
// And how to be rid of it.
#pragma once

#include <map>
#include <span>

#include "map/map.hpp"
#include "map/messages.hpp"
#include "optim/direction.hpp"

namespace ygslam {

/// Of the keyframes that have it, ready for an adjustment but for the index of the pose. Where
/// gravity pulls in the world nobody knows beforehand: all keyframes of a submap say it together.
/// What disagrees with the others counts less. Empty without an IMU.
[[nodiscard]] std::map<KeyframeId, MeasuredDirection> measured_gravity(const Map& map);

/// The same of a few keyframes at a time, of a map that grows by one after the other: where gravity
/// pulls is found anew from all keyframes where they are few, or a share of them has come since, so
/// that a keyframe costs as much at the end of a long run as at its begin.
class GravityOfGrowingMap {
 public:
  [[nodiscard]] std::map<KeyframeId, MeasuredDirection> of(const Map& map,
                                                           std::span<const KeyframeId> keyframes);
  /// The map was corrected: where gravity pulls in it is not known any more.
  void forget() { down_world_.clear(); }

 private:
  [[nodiscard]] bool has_grown(const Map& map) const;
  void look_at(const Map& map);

  std::map<KeyframeId, Vec3> down_world_;  // by the root of the submap
  std::size_t made_ = 0;                   // keyframes, when it was found
};

/// Gravity and turns go out of the keyframes that were told them. @return whether there were any.
bool forget_imu(Map& map, const ImuRetraction& retraction);

}  // namespace ygslam
