// What is told about every frame, and what is kept of it.
#pragma once

#include <array>
#include <cmath>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "core/time.hpp"
#include "geometry/packed_pose.hpp"
#include "geometry/smooth_turns.hpp"
#include "inertial/inertial_estimator.hpp"
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
  bool provisional = false;                         ///< see TrackResult
  double correction_m = 0;                          ///< see TrackResult
  double position_std_m = 0, rotation_std_rad = 0;  ///< by seen_covariance(), of all three axes
  Doubt odom_drift, map_drift;                      ///< see PoseDoubt
  SE3 T_odom_camera;                                ///< as delivered, as its covariances
  Mat6 odom_covariance = Mat6::Zero(), map_covariance = Mat6::Zero();
  bool few_static = false;   ///< see PointLabels::too_few_static
  int mask_age_frames = -1;  ///< of the newest mask used; -1 = none
  std::vector<TrackedObject> objects;
  double track_ms = 0, track_cpu_ms = 0, orb_ms = 0, motion_ms = 0, pose_ms = 0;
  double mask_ms = 0;  ///< what masks cost beside tracking
  /// How the camera turned since the record with a pose before, where a gyroscope knows; and the
  /// distance of the points that gave the pose (TurningPose).
  std::optional<CameraTurn> turn{};
  double distance_m = 0;

  [[nodiscard]] bool has_pose() const { return ygslam::has_pose(state); }
};

/// What a frame cost: tracking (without waits) and the wait for masks, or making them.
struct FrameTimes {
  double track_ms = 0, track_cpu_ms = 0;
  double mask_ms = 0;
};
[[nodiscard]] FrameRecord make_record(const RgbdFrame& frame, const TrackResult& result,
                                      const FrameTimes& times,
                                      const std::optional<CameraTurn>& turn = {});

/// Called for every frame, in the thread that called process().
using FrameSink = std::function<void(const FrameRecord&, const TrackResult&)>;

/// All that is kept of a tracked frame to the end of the run.
struct PosedFrame {
  Timestamp stamp;
  FrameId frame = kNoFrame;
  KeyframeId reference = kNoKeyframe;
  PackedPose T_camera_reference;
  float std_rad = 0, distance_m = 0;  ///< as those that follow of a TurningPose
  std::array<float, 3> turn_rad{};
  float turn_std_rad = 0;

  PosedFrame() = default;
  explicit PosedFrame(const FrameRecord& record)
      : stamp(record.stamp),
        frame(record.frame),
        reference(record.pose.reference),
        T_camera_reference(record.pose.T_camera_reference),
        std_rad(static_cast<float>(record.rotation_std_rad / std::sqrt(3.0))),
        distance_m(static_cast<float>(record.distance_m)) {
    if (!record.turn) return;
    Eigen::Map<Eigen::Vector3f>(turn_rad.data()) = record.turn->turn_rad.cast<float>();
    turn_std_rad = static_cast<float>(record.turn->std_rad);
  }
  /// @param T_world_camera as it is by now.
  [[nodiscard]] TurningPose turning(const SE3& T_world_camera) const {
    return {stamp,
            T_world_camera,
            std_rad,
            distance_m,
            Vec3(turn_rad[0], turn_rad[1], turn_rad[2]),
            turn_std_rad};
  }
};
static_assert(sizeof(PosedFrame) == 96, "docs/architecture.md tells");
using Trajectory = std::deque<PosedFrame>;

/// T_camera_world of frames whose poses were found again: at the end (system/early_frames), or
/// later in the run (RetrackedPose).
using RevisedPoses = std::map<FrameId, SE3>;

/// What is kept of a RetrackedFrame to the end of the run. Of one frame the last counts.
struct RetrackedPose {
  FrameId frame = kNoFrame;
  KeyframeId reference = kNoKeyframe;
  PackedPose T_camera_reference;

  RetrackedPose() = default;
  explicit RetrackedPose(const RetrackedFrame& retracked)
      : frame(retracked.frame),
        reference(retracked.pose.reference),
        T_camera_reference(retracked.pose.T_camera_reference) {}
  void revise(const Map& map, RevisedPoses& revised) const {
    revised[frame] = T_camera_reference.unpacked() * map.resolved_pose(reference);
  }
};
static_assert(sizeof(RetrackedPose) == 64, "docs/architecture.md tells");

/// T_camera_world of a frame in the map as it is: of the keyframe that was made of it, else
/// relative to its reference.
[[nodiscard]] SE3 pose_in(const Map& map, FrameId frame, KeyframeId reference,
                          const SE3& T_camera_reference);

/// T_world_camera of the tracked frames, in their order, with the map's present keyframe poses:
/// where a keyframe lies otherwise than it was tracked, the frames about it do so, too.
[[nodiscard]] std::vector<SE3> corrected_poses(const Trajectory& trajectory,
                                               const RevisedPoses& revised, const Map& map);

}  // namespace ygslam
