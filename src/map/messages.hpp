// What tracking hands to mapping.
#pragma once

#include <utility>
#include <vector>

#include "image/rgbd_frame.hpp"
#include "map/keyframe.hpp"

namespace ygslam {

struct KeyframeCandidate {
  FramePtr frame;
  FeaturesPtr features;
  std::vector<LandmarkId> landmarks;   ///< per feature, kNoLandmark where none matched
  std::vector<float> static_weight;    ///< per feature: 0 = dynamic, 1 = static
  KeyframeId reference = kNoKeyframe;  ///< kNoKeyframe for the very first
  SE3 T_camera_reference;
  /// Landmarks predicted in view since the last candidate: id, times visible, times found.
  struct Seen {
    LandmarkId id;
    int visible = 0;
    int found = 0;
  };
  std::vector<Seen> seen;
};

}  // namespace ygslam
