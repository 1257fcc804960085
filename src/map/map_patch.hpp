// A correction of the map, computed on a copy of it while the map went on: a pose graph's, a bundle
// adjustment's, a submap's new place.
#pragma once

#include <vector>

#include "core/ids.hpp"
#include "geometry/se3.hpp"
#include "map/landmark.hpp"

namespace ygslam {

/// What it was computed from stands beside what it says, so that Map::apply() can tell what has
/// changed since and carry it along.
struct MapPatch {
  struct Pose {
    KeyframeId keyframe = kNoKeyframe;
    SE3 T_camera_base;   ///< T_camera_world in the map it was computed from
    SE3 T_camera_world;  ///< corrected
  };
  struct Point {
    LandmarkId landmark = kNoLandmark;
    Vec3 p_base = Vec3::Zero();   ///< p_world in the map it was computed from
    Vec3 p_world = Vec3::Zero();  ///< corrected
  };
  KeyframeId first_later{0};  ///< keyframes from this number on were not in it
  std::vector<Pose> poses;
  std::vector<Point> points;  ///< those not named follow the keyframe that first saw them
};

}  // namespace ygslam
