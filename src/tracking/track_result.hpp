// What tracking tells of a frame.
#pragma once

#include <optional>
#include <vector>

#include "image/pixel_mask.hpp"
#include "map/messages.hpp"
#include "motion/classification/point_labels.hpp"
#include "objects/object_tracker.hpp"
#include "segment/segmenter.hpp"
#include "tracking/pose_doubt.hpp"
#include "tracking/retracker.hpp"
#include "tracking/shutter_watch.hpp"
#include "tracking/track_judge.hpp"

namespace ygslam {

struct TrackResult {
  TrackState state = TrackState::kWaiting;
  SE3 T_world_camera{};  ///< as known now; meaningful where has_pose(state)
  /// The same in a frame that drifts but never jumps (odom of ROS REP 105): corrections of the map
  /// and relocalisation move T_world_odom instead. While lost it stays where it was.
  SE3 T_odom_camera{};
  SE3 T_world_odom{};
  /// Found again far from where odometry left it, by what it sees alone: another room may look the
  /// same. Until it has gone some way in the map from there. Or in a submap begun after a loss,
  /// whose place is a guess until it is joined to the world.
  bool provisional = false;
  bool unplaced = false;  ///< in such a submap
  /// Coasting though something was seen that gave a pose: it moves, as IMU or wheels know; and it
  /// has taken vision and them along for half a second.
  bool overruled = false, went_along = false;
  /// Of the twist xi of exp(xi) * T_camera_world [m, rad], against the points that the frame was
  /// matched with: what odometry or map have drifted is not in it. To first order also of the error
  /// of T_odom_camera * exp(error), the camera's in its own axes, which is -xi. None of the first
  /// frame, nor while lost.
  std::optional<Mat6> covariance{};
  PoseDoubt doubt{};                              ///< what is not in it; the runner's
  std::optional<ImuRetraction> imu_retraction{};  ///< the inertial stage's
  double correction_m = 0;      ///< how far a change of T_world_odom moved the camera in this frame
  KeyframeRelativePose pose{};  ///< follows later corrections of the map
  ReadOut read_out{};           ///< that the features were brought to the middle instant with
  /// The keyframe the camera shares most with, where that is no longer the view's reference.
  std::optional<KeyframeId> wanted_view{};
  std::optional<KeyframeCandidate> candidate{};
  FeaturesPtr features{};
  PointLabels labels{};  ///< final label and weight of every feature
  /// Pixels that are not of the world: found by itself, and all of them. Null: none.
  PixelMaskPtr ego_mask{}, masked_pixels{};
  bool ego_mask_grew = false;  ///< the map may hold landmarks that are not of the world
  std::vector<RetrackedFrame> retracked{};  ///< earlier frames, better placed
  int mask_age_frames = -1;                 ///< of the newest mask used; -1 = none
  std::vector<SegmentationPtr> masks{};  ///< that arrived with this frame, of this or earlier ones
  std::vector<TrackedObject> objects{};  ///< things that move or could
  std::vector<LandmarkId> landmarks{};   ///< per feature, matched
  std::optional<ShutterReport> shutter{};     ///< where something new is known
  std::optional<ReadOut> guessed_read_out{};  ///< of the features, while the file says none
  /// Of TrackerConfig::calibrated, once there is one.
  std::optional<CameraEstimator::Estimate> camera_estimate{};
  int matches = 0;
  int inliers = 0;
  double orb_ms = 0, motion_ms = 0, pose_ms = 0;
};

}  // namespace ygslam
