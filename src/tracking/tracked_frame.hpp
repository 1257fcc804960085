// One frame as the tracker knows it.
#pragma once

#include <vector>

#include "features/feature.hpp"
#include "features/feature_grid.hpp"
#include "geometry/rolling_shutter.hpp"
#include "image/rgbd_frame.hpp"
#include "map/messages.hpp"

namespace ygslam {

struct TrackedFrame {
  FramePtr frame;
  FeaturesPtr features;
  ReadOut read_out;  ///< that the features were brought to the middle with
  FeatureGrid grid;
  std::vector<float> static_weight;   ///< per feature, 0 = dynamic .. 1 = static
  std::vector<LandmarkId> landmarks;  ///< per feature: the landmark it agreed with, or kNoLandmark
  KeyframeRelativePose pose;
};

}  // namespace ygslam
