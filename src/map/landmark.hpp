// A static point of the world that several keyframes saw.
#pragma once

#include <algorithm>
#include <vector>

#include "core/ids.hpp"
#include "features/feature.hpp"
#include "geometry/se3.hpp"

namespace ygslam {

struct LandmarkObservation {
  KeyframeId keyframe = kNoKeyframe;
  std::uint32_t feature = 0;  ///< index into the keyframe's features
};

struct Landmark {
  LandmarkId id = kNoLandmark;
  Vec3 p_world = Vec3::Zero();
  Vec3 normal_world = Vec3::Zero();  ///< mean direction from the observing cameras, unit length
  Descriptor descriptor;      ///< the observed one with the least median distance to the others
  double min_distance_m = 0;  ///< range in which the pyramid can show it
  double max_distance_m = 0;
  std::vector<LandmarkObservation> observations;  ///< ascending keyframe id
  KeyframeId first_keyframe = kNoKeyframe;
  int visible = 1;       ///< frames in whose view it was predicted
  int found = 1;         ///< frames that matched it
  int seen_through = 0;  ///< keyframes that saw what is behind it, since one that saw it

  [[nodiscard]] double found_ratio() const { return static_cast<double>(found) / visible; }
  /// How far its history speaks for a point that stands still, 0..1: what has moved away, or is
  /// called dynamic each time, is not found where the map has it.
  [[nodiscard]] float static_weight() const {
    constexpr double kFoundAlways = 0.6;  // occlusion and missed corners cost good ones no more
    return static_cast<float>(std::min(1.0, found_ratio() / kFoundAlways));
  }
};

}  // namespace ygslam
