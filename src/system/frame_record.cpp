#include "system/frame_record.hpp"

#include <algorithm>

namespace ygslam {
namespace {

/// What a read-out time that was found late changes between a frame and the keyframe it refers to.
class LateReadout {
 public:
  explicit LateReadout(const Trajectory& trajectory) : trajectory_(trajectory) {
    const auto newest = std::find_if(trajectory.rbegin(), trajectory.rend(), is_sensitive);
    if (newest != trajectory.rend()) found_s_ = newest->readout_in_use_s;
  }

  [[nodiscard]] SE3 corrected(const SE3& T_camera_world, const PosedFrame& frame, const Map& map,
                              KeyframeId keyframe) const {
    const Vec6 camera_twist = twist(frame);
    if (camera_twist.isZero(0)) return T_camera_world;
    const SE3 T_keyframe_world = map.resolved_pose(keyframe);
    return SE3::exp(camera_twist) * T_camera_world * T_keyframe_world.inverse() *
           SE3::exp(-twist_at(map.frame_of(keyframe))) * T_keyframe_world;
  }

 private:
  static bool is_sensitive(const PosedFrame& frame) {
    return std::any_of(frame.twist_per_s.begin(), frame.twist_per_s.end(),
                       [](float value) { return value != 0; });
  }
  [[nodiscard]] Vec6 twist(const PosedFrame& frame) const {
    Vec6 twist;
    for (std::size_t i = 0; i < frame.twist_per_s.size(); ++i)
      twist[static_cast<Eigen::Index>(i)] = frame.twist_per_s[i];
    return (found_s_ - frame.readout_in_use_s) * twist;
  }
  /// The first frame's velocity showed only in the second.
  [[nodiscard]] Vec6 twist_at(FrameId frame) const {
    const auto at = std::ranges::lower_bound(trajectory_, frame, {}, &PosedFrame::frame);
    if (at == trajectory_.end() || at->frame != frame) return Vec6::Zero();
    const auto next = std::next(at);
    return twist(is_sensitive(*at) || next == trajectory_.end() ? *at : *next);
  }

  const Trajectory& trajectory_;
  float found_s_ = 0;
};

}  // namespace

FrameRecord make_record(const RgbdFrame& frame, const TrackResult& result,
                        const ScopedTimer& timer) {
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
  record.readout = result.readout;
  record.orb_ms = result.orb_ms;
  record.motion_ms = result.motion_ms;
  record.pose_ms = result.pose_ms;
  return record;
}

std::vector<SE3> corrected_poses(const Trajectory& trajectory, const Map& map) {
  const LateReadout late(trajectory);
  std::vector<SE3> poses;
  for (const PosedFrame& frame : trajectory) {
    const KeyframeId own = map.keyframe_of(frame.frame);
    const KeyframeId reference = own != kNoKeyframe ? own : frame.reference;
    SE3 T_camera_world = map.resolved_pose(reference);
    if (own == kNoKeyframe) T_camera_world = frame.T_camera_reference.unpacked() * T_camera_world;
    const KeyframeId corrected = map.nearest_corrected(reference);
    if (corrected != own) T_camera_world = late.corrected(T_camera_world, frame, map, corrected);
    poses.push_back(T_camera_world.inverse());
  }
  return poses;
}

}  // namespace ygslam
