// What tracking hands to mapping.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "image/rgbd_frame.hpp"
#include "map/keyframe.hpp"

namespace ygslam {

/// How poses are kept outside the map: they follow its corrections.
struct KeyframeRelativePose {
  KeyframeId reference = kNoKeyframe;  ///< kNoKeyframe: the run's first keyframe
  SE3 T_camera_reference;
};

/// All that an IMU said of frames from there on turned out to be wrong.
struct ImuRetraction {
  Timestamp since;
};

/// A frame that the tracker would have as a keyframe; the mapper numbers it.
struct KeyframeCandidate {
  FramePtr frame;
  FeaturesPtr features;
  ReadOut read_out;                   ///< see KeyframeData
  std::vector<LandmarkId> landmarks;  ///< per feature, kNoLandmark where none matched
  std::vector<float> static_weight;   ///< per feature: 0 = dynamic, 1 = static
  KeyframeRelativePose pose;          ///< relative to a keyframe the mapper has published
  /// Landmarks predicted in view since the last candidate: id, times visible, times found.
  struct Seen {
    LandmarkId id;
    int visible = 0;
    int found = 0;
  };
  std::vector<Seen> seen;
  /// Of the oldest view that the landmarks above were found in.
  std::uint64_t map_version = 0;
  /// The camera was lost and its pose is a guess: a submap begins. So far it can have come since it
  /// was last known; 0: the place is known by appearance alone.
  std::optional<double> submap_reach_m{};
  /// Set where vision did not give the pose: the motion since the last frame whose pose it gave.
  std::optional<KeyframeMotion> motion{};
  std::optional<MeasuredGravity> gravity{};  ///< if there is an IMU that knows
  std::optional<MeasuredTurn> turn{};        ///< the same
};

}  // namespace ygslam
