// How one map lies to another that shows some of the same places.
#pragma once

#include <vector>

#include "loop/place_finder.hpp"

namespace ygslam {

struct MapAlignmentConfig {
  PlaceIndexConfig index;
  PlaceFinderConfig finder;
  int min_pairs = 3;  ///< independent ones: over 1 m or 30 degrees from each other
  /// Pairs agree about the place of a keyframe within this and a part of the way between them.
  double same_m = 0.15;
  double same_ratio = 0.03;
  double same_rad = 0.1;
  double ambiguous_share = 0.5;  ///< of the best's pairs: another alignment with so many is a rival
};

/// A view in b that shows a place of a.
struct MapPair {
  KeyframeId in_b = kNoKeyframe;  ///< the keyframe itself, or the one that the frame refers to
  SE3 T_camera_b;                 ///< pose of the view
  PlaceMatch match;               ///< in a
};

struct MapAlignment {
  enum class Outcome : std::uint8_t { kAligned, kNoOverlap, kAmbiguous };
  Outcome outcome = Outcome::kNoOverlap;
  SE3 T_a_b;  ///< of the world frames; of the pairs that agree, however few, if there are any
  std::vector<MapPair> pairs;  ///< that agree on it
  int independent = 0;         ///< of them
  int found = 0;               ///< keyframes of b that show some place of a
  /// How far apart in b the pairs lie: rooms that look alike agree over a room, too.
  double extent_m = 0;
};

/// Every keyframe of b is looked for in a. The largest set of them that agree on one alignment
/// counts (as Mangelson et al. 2018, by support of each pair).
[[nodiscard]] MapAlignment align_maps(const Map& a, const Map& b, const Camera& camera,
                                      const MapAlignmentConfig& config);

/// The same from pairs that were found.
[[nodiscard]] MapAlignment align_pairs(const std::vector<MapPair>& pairs,
                                       const MapAlignmentConfig& config);

}  // namespace ygslam
