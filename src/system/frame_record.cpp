#include "system/frame_record.hpp"

#include <cmath>

#include "system/pose_covariance.hpp"

namespace ygslam {

FrameRecord make_record(const RgbdFrame& frame, const TrackResult& result, const FrameTimes& times,
                        const std::optional<CameraTurn>& turn) {
  FrameRecord record;
  record.track_ms = times.track_ms;
  record.track_cpu_ms = times.track_cpu_ms;
  record.mask_ms = times.mask_ms;
  record.frame = frame.id;
  record.stamp = frame.stamp;
  record.state = result.state;
  record.pose = result.pose;
  record.T_world_camera_live = result.T_world_camera;
  record.matches = result.matches;
  record.inliers = result.inliers;
  record.static_points = result.labels.static_points;
  record.dynamic_points = result.labels.dynamic_points;
  record.unknown_points = result.labels.unknown_points;
  record.few_static = result.labels.too_few_static;
  record.mask_age_frames = result.mask_age_frames;
  record.provisional = result.provisional;
  record.correction_m = result.correction_m;
  const Mat6 covariance = seen_covariance(result);
  record.position_std_m = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  record.rotation_std_rad = std::sqrt(covariance.bottomRightCorner<3, 3>().trace());
  record.turn = turn;
  if (is_seen(result.state) && result.covariance)
    record.distance_m = distance_of_points(*result.covariance);
  record.odom_drift = result.doubt.odom;
  record.map_drift = result.doubt.map;
  record.T_odom_camera = result.T_odom_camera;
  record.odom_covariance = odom_covariance(result);
  record.map_covariance = map_covariance(result);
  record.objects = result.objects;
  record.orb_ms = result.orb_ms;
  record.motion_ms = result.motion_ms;
  record.pose_ms = result.pose_ms;
  return record;
}

SE3 pose_in(const Map& map, FrameId frame, KeyframeId reference, const SE3& T_camera_reference) {
  const KeyframeId own = map.keyframe_of(frame);
  return own != kNoKeyframe ? map.resolved_pose(own)
                            : T_camera_reference * map.resolved_pose(reference);
}

namespace {

/// A frame that became a keyframe: the map knows its pose better than tracking did.
struct Anchor {
  Timestamp stamp;
  KeyframeId keyframe, reference;
  Vec6 twist;  ///< T_camera_world in the map = exp(twist) * as tracked

  /// What a frame with this reference would be off by here: like this one, if it was tracked
  /// relative to the same keyframe.
  [[nodiscard]] Vec6 error_of(KeyframeId frame_reference) const {
    const bool is_alike = frame_reference == reference && frame_reference != keyframe;
    return is_alike ? twist : Vec6::Zero();
  }
};

std::vector<Anchor> anchors_of(const Trajectory& trajectory, const Map& map) {
  std::vector<Anchor> anchors;
  for (const PosedFrame& frame : trajectory) {
    const KeyframeId own = map.keyframe_of(frame.frame);
    if (own == kNoKeyframe) continue;
    const SE3 T_world_tracked =
        (frame.T_camera_reference.unpacked() * map.resolved_pose(frame.reference)).inverse();
    anchors.push_back(
        {frame.stamp, own, frame.reference, (map.resolved_pose(own) * T_world_tracked).log()});
  }
  return anchors;
}

/// Between two keyframes the error of tracking grows from that at the first to that at the second.
Vec6 error_between(const Anchor& before, const Anchor& after, const PosedFrame& frame) {
  const double share =
      seconds_between(frame.stamp, before.stamp) / seconds_between(after.stamp, before.stamp);
  return (1 - share) * before.error_of(frame.reference) + share * after.error_of(frame.reference);
}

}  // namespace

std::vector<SE3> corrected_poses(const Trajectory& trajectory, const RevisedPoses& revised,
                                 const Map& map) {
  const std::vector<Anchor> anchors = anchors_of(trajectory, map);
  std::vector<SE3> poses;
  std::size_t passed = 0;  // anchors
  for (const PosedFrame& frame : trajectory) {
    SE3 T_camera_world =
        pose_in(map, frame.frame, frame.reference, frame.T_camera_reference.unpacked());
    if (map.keyframe_of(frame.frame) != kNoKeyframe) ++passed;
    if (const auto found = revised.find(frame.frame); found != revised.end()) {
      T_camera_world = found->second;
    } else if (map.keyframe_of(frame.frame) == kNoKeyframe && passed > 0 &&
               passed < anchors.size()) {
      T_camera_world =
          SE3::exp(error_between(anchors[passed - 1], anchors[passed], frame)) * T_camera_world;
    }
    poses.push_back(T_camera_world.inverse());
  }
  return poses;
}

}  // namespace ygslam
