// One frame as the tracker knows it.
#pragma once

#include <vector>

#include "features/feature.hpp"
#include "features/feature_grid.hpp"
#include "geometry/rolling_shutter.hpp"
#include "image/rgbd_frame.hpp"
#include "map/local_view.hpp"
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
  LocalViewPtr view;   ///< that it was tracked in ...
  SE3 T_camera_world;  ///< ... and its pose there, if it has landmarks

  /// How many features with depth are static with at least this weight.
  [[nodiscard]] int usable_points(float min_static_weight) const {
    int usable = 0;
    for (std::size_t i = 0; i < features->size(); ++i)
      if (features->points[i].depth_m > 0 && static_weight[i] >= min_static_weight) ++usable;
    return usable;
  }
};

}  // namespace ygslam
