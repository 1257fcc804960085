// What the map does not need goes: landmarks nobody finds again or that
// keyframes see through, keyframes that show nothing new.
#pragma once

#include <vector>

#include "geometry/camera.hpp"
#include "map/map.hpp"

namespace ygslam {

struct CullingConfig {
  double min_found_ratio = 0.25;
  int recent_keyframes = 3;      ///< age at which a landmark must have been seen by ...
  int min_observations = 2;      ///< ... this many keyframes
  int seen_through = 3;          ///< keyframes in a row that see through a landmark end it
  double redundant_share = 0.9;  ///< of a keyframe's landmarks that ...
  double revisit_share = 0.8;    ///< the same where a keyframe of an earlier visit shows its place
  int redundant_observers = 3;   ///< ... this many others see at the same or a finer scale
  int protected_keyframes = 3;   ///< newest ones that are never culled
};

/// Judges the recent landmarks; those that passed or went are taken out of the list.
void cull_landmarks(Map& map, std::vector<LandmarkId>& recent_landmarks,
                    const CullingConfig& config);

/// Ends landmarks of the neighbours that this keyframe, as others before it, saw through: what they
/// were on has been carried away. @return number removed.
int cull_seen_through(Map& map, const Camera& camera, KeyframeId keyframe,
                      const CullingConfig& config);

/// Judges the neighbours of a keyframe. @return the removed keyframes.
std::vector<KeyframeId> cull_keyframes(Map& map, KeyframeId around, const CullingConfig& config);

}  // namespace ygslam
