#include "system/frame_record.hpp"

namespace ygslam {

FrameRecord make_record(const RgbdFrame& frame, const TrackResult& result) {
  FrameRecord record;
  record.frame = frame.id;
  record.stamp = frame.stamp;
  record.state = result.state;
  record.pose = result.pose;
  record.T_world_camera_live = result.T_world_camera;
  record.matches = result.matches;
  record.inliers = result.inliers;
  for (const MotionLabel label : result.labels.label) {
    record.static_points += static_cast<int>(label == MotionLabel::kStatic);
    record.dynamic_points += static_cast<int>(label == MotionLabel::kDynamic);
    record.unknown_points += static_cast<int>(label == MotionLabel::kUnknown);
  }
  record.few_static = result.labels.too_few_static;
  record.mask_age_frames = result.mask_age_frames;
  record.objects = result.objects;
  record.orb_ms = result.orb_ms;
  record.motion_ms = result.motion_ms;
  record.pose_ms = result.pose_ms;
  return record;
}

SE3 corrected_pose(const FrameRecord& record, const Map& map) {
  if (const KeyframeId own = map.keyframe_of(record.frame); own != kNoKeyframe)
    return map.resolved_pose(own).inverse();
  return (record.pose.T_camera_reference * map.resolved_pose(record.pose.reference)).inverse();
}

}  // namespace ygslam
