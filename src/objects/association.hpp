// Which track each instance of a mask shows.
#pragma once

#include <map>
#include <span>
#include <vector>

#include "objects/track.hpp"

namespace ygslam {

using Tracks = std::map<int, Track>;  ///< by a key that only grows

struct Association {
  std::vector<int> track_of;    ///< per instance the key of its track, -1 = none
  std::vector<int> duplicates;  ///< young tracks of who has now turned out to be an older one
};

/// One to one: tracks in sight by their affinity, then those out of sight by re-identification.
/// @param frame the mask's own. @param points_on per instance the points of the frame on it.
[[nodiscard]] Association associate(std::span<const InstanceView> instances,
                                    std::span<const PointIndices> points_on,
                                    const ObjectFrame& frame, const Tracks& tracks);

/// Whether a track that has just come into sight may turn out to be one that was out of it.
[[nodiscard]] bool may_be_known(const Track& young, const Tracks& tracks, Timestamp now);

}  // namespace ygslam
