// One frame as the tracker keeps it.
#pragma once

#include <vector>

#include "map/local_view.hpp"
#include "map/messages.hpp"
#include "tracking/frame_features.hpp"

namespace ygslam {

struct TrackedFrame {
  FrameFeatures seen;
  std::vector<LandmarkId> landmarks;  ///< per feature: the landmark it agreed with, or kNoLandmark
  KeyframeRelativePose pose;
  LocalViewPtr view;   ///< that it was tracked in ...
  SE3 T_camera_world;  ///< ... and its pose there, if it has landmarks
  SE3 T_odom_camera{};
};

}  // namespace ygslam
