// What is kept of every frame for the files at the end.
#pragma once

#include <vector>

#include "core/time.hpp"
#include "map/map.hpp"
#include "tracking/tracker.hpp"

namespace ygslam {

struct FrameRecord {
  FrameId frame = kNoFrame;
  Timestamp stamp;
  TrackState state = TrackState::kWaiting;
  KeyframeRelativePose pose;
  SE3 T_world_camera_live;  ///< as delivered
  int matches = 0, inliers = 0;
  int static_points = 0, dynamic_points = 0, unknown_points = 0;
  bool few_static = false;   ///< suspicious points had to come back
  int mask_age_frames = -1;  ///< of the newest mask used; -1 = none
  std::vector<TrackedObject> objects;
  double track_ms = 0, track_cpu_ms = 0, orb_ms = 0, motion_ms = 0, pose_ms = 0;

  [[nodiscard]] bool has_pose() const {
    return state == TrackState::kTracking || state == TrackState::kWeak;
  }
};

[[nodiscard]] FrameRecord make_record(const RgbdFrame& frame, const TrackResult& result);

/// Pose of a tracked frame with the map's present keyframe poses.
[[nodiscard]] SE3 corrected_pose(const FrameRecord& record, const Map& map);

}  // namespace ygslam
