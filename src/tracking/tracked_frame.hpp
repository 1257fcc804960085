// One frame as the tracker knows it.
#pragma once

#include <vector>

#include "features/feature.hpp"
#include "features/feature_grid.hpp"
#include "geometry/se3.hpp"
#include "image/rgbd_frame.hpp"
#include "map/messages.hpp"

namespace ygslam {

struct TrackedFrame {
  FramePtr frame;
  FeaturesPtr features;
  Vec6 body_velocity = Vec6::Zero();  ///< that the features were moved to the middle with
  FeatureGrid grid;
  std::vector<float> static_weight;   ///< per feature, 0 = dynamic .. 1 = static
  std::vector<LandmarkId> landmarks;  ///< per feature: the landmark it agreed with, or kNoLandmark
  KeyframeRelativePose pose;
};

}  // namespace ygslam
