#include "system/frame_record.hpp"

namespace ygslam {

FrameRecord make_record(const RgbdFrame& frame, const TrackResult& result, const ScopedTimer& timer,
                        double mask_ms) {
  FrameRecord record;
  record.track_ms = timer.wall_ms();
  record.track_cpu_ms = timer.cpu_ms();
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
  record.objects = result.objects;
  record.orb_ms = result.orb_ms;
  record.motion_ms = result.motion_ms;
  record.pose_ms = result.pose_ms;
  record.mask_ms = mask_ms;
  return record;
}

SE3 pose_in(const Map& map, FrameId frame, KeyframeId reference, const SE3& T_camera_reference) {
  const KeyframeId own = map.keyframe_of(frame);
  return own != kNoKeyframe ? map.resolved_pose(own)
                            : T_camera_reference * map.resolved_pose(reference);
}

std::vector<SE3> corrected_poses(const Trajectory& trajectory, const RevisedPoses& revised,
                                 const Map& map) {
  std::vector<SE3> poses;
  for (const PosedFrame& frame : trajectory) {
    const bool is_keyframe = map.keyframe_of(frame.frame) != kNoKeyframe;
    const auto found_again = is_keyframe ? revised.end() : revised.find(frame.frame);
    const SE3 T_camera_world =
        found_again != revised.end()
            ? found_again->second
            : pose_in(map, frame.frame, frame.reference, frame.T_camera_reference.unpacked());
    poses.push_back(T_camera_world.inverse());
  }
  return poses;
}

}  // namespace ygslam
