// The tracking stage: one frame in, its pose out (the paper's tracking thread).
#pragma once

#include <optional>
#include <span>

#include "core/rng.hpp"
#include "features/orb.hpp"
#include "geometry/camera.hpp"
#include "geometry/motion_model.hpp"
#include "map/local_view.hpp"
#include "map/messages.hpp"
#include "motion/classification/point_classifier.hpp"
#include "objects/object_tracker.hpp"
#include "segment/segmenter.hpp"
#include "tracking/free_space_check.hpp"
#include "tracking/keyframe_proposer.hpp"
#include "tracking/localization.hpp"
#include "tracking/pose_estimator.hpp"
#include "tracking/relocalizer.hpp"
#include "tracking/shutter_watch.hpp"
#include "tracking/tracked_frame.hpp"

namespace ygslam {

enum class TrackState : std::uint8_t {
  kWaiting,  ///< no frame with enough depth yet
  kTracking,
  kWeak,  ///< a pose, but few points agree on it or they leave it uncertain
  kLost,
};
[[nodiscard]] const char* to_string(TrackState state);

struct TrackerConfig {
  PoseEstimatorConfig pose;
  MotionModelConfig motion_model;
  KeyframePolicyConfig keyframe;
  RelocalizerConfig relocalizer;
  FreeSpaceConfig free_space;
  ObjectConfig objects;
  /// What of the camera is looked for in place of an unknown read-out time. Not a setting.
  std::vector<CameraParameter> calibrated{};
  bool proposes_keyframes = true;     ///< false: frames are only placed. Not a setting.
  bool starts_submaps = true;         ///< false: a lost camera waits for a place it knows
  int min_start_points = 100;         ///< static features with depth in the first frame
  int min_inliers = 30;               ///< below: weak; below half of it: lost
  int weak_frames_until_lost = 10;    ///< in a row
  double weak_position_std_m = 0.03;  ///< the camera centre less certain than this: weak
  double lost_position_std_m = 0.1;   ///< ... than this: lost
  /// A weak pose farther than this from the prediction (or than this speed would carry it over a
  /// longer gap), or after a loss from the last known place, rests on wrong matches.
  double max_jump_m = 0.08;
  double max_jump_mps = 1.0;

  /// Fewer inliers: lost.
  [[nodiscard]] int least_inliers() const { return min_inliers / 2; }
};

struct TrackResult {
  TrackState state = TrackState::kWaiting;
  SE3 T_world_camera;  ///< as known now; meaningful while tracking or weak
  /// The same in a frame that drifts but never jumps (odom of ROS REP 105): corrections of the map
  /// and relocalisation move T_world_odom instead. While lost it stays where it was.
  SE3 T_odom_camera;
  SE3 T_world_odom;
  /// Found again far from where odometry left it, by what it sees alone: another room may look the
  /// same. Until it has gone some way in the map from there. Or in a submap begun after a loss,
  /// whose place is a guess until it is joined to the world.
  bool provisional = false;
  bool unplaced = false;  ///< in such a submap
  /// Of the twist xi of exp(xi) * T_camera_world [m, rad], against the points that the frame was
  /// matched with: what odometry or map have drifted is not in it. None of the first frame, nor
  /// while lost.
  std::optional<Mat6> covariance;
  double correction_m = 0;    ///< how far a change of T_world_odom moved the camera in this frame
  KeyframeRelativePose pose;  ///< follows later corrections of the map
  ReadOut read_out;           ///< that the features were brought to the middle instant with
  /// The keyframe the camera shares most with, where that is no longer the view's reference.
  std::optional<KeyframeId> wanted_view;
  std::optional<KeyframeCandidate> candidate;
  FeaturesPtr features;
  PointLabels labels;                  ///< final label and weight of every feature
  int mask_age_frames = -1;            ///< of the newest mask used; -1 = none
  std::vector<SegmentationPtr> masks;  ///< that arrived with this frame, of this or earlier frames
  std::vector<TrackedObject> objects;  ///< things that move or could
  std::vector<LandmarkId> landmarks;   ///< per feature, matched
  std::optional<ShutterReport> shutter;     ///< where something new is known
  std::optional<ReadOut> guessed_read_out;  ///< of the features, while the camera's file says none
  /// Of TrackerConfig::calibrated, once there is one.
  std::optional<CameraEstimator::Estimate> camera_estimate;
  int matches = 0;
  int inliers = 0;
  double orb_ms = 0, motion_ms = 0, pose_ms = 0;
};

class Tracker {
 public:
  Tracker(const TrackerConfig& config, const OrbConfig& orb, const DynamicConfig& dynamic,
          const Camera& camera, std::uint64_t seed);

  /// @param view the newest published view (may be empty before the first keyframe is mapped).
  /// @param masks that arrived since the last call, of this or earlier frames.
  /// @param mapper_busy spares the mapper all but indispensable keyframes.
  [[nodiscard]] TrackResult step(const FramePtr& frame, const LocalViewPtr& view,
                                 std::span<const SegmentationPtr> masks, bool mapper_busy);

 private:
  struct PoseHypothesis {
    std::optional<PoseResult> pose;
    double jump_m = 0;  ///< of the camera centre from its prediction; 0 after relocalisation
  };
  // The steps of a frame, in their order.
  [[nodiscard]] TrackedFrame extract_features(const FramePtr& frame);
  /// Moves the features to the frame's middle instant; a global shutter's stay as they are.
  void move_to_middle(TrackedFrame& current, const Vec6& body_velocity) const;
  [[nodiscard]] std::optional<FlowPrediction> predicted_flow(const RgbdFrame& frame) const;
  /// A frame after the first: its pose, final labels, objects, and what is proposed to the mapper.
  void track(TrackedFrame current, FrameEvidence evidence, const LocalView& view, bool mapper_busy,
             TrackResult& result);
  void start(TrackedFrame current, FrameEvidence evidence, TrackResult& result);
  /// The first frame of a run that goes on with a map: found there, or lost.
  void start_in_map(TrackedFrame current, FrameEvidence evidence, const LocalView& view,
                    TrackResult& result);
  [[nodiscard]] SE3 last_pose(const LocalView& view);
  [[nodiscard]] PoseHypothesis find_pose(TrackedFrame& current, const LocalView& view,
                                         const SE3& T_last_world);
  [[nodiscard]] TrackState assess(const PoseHypothesis& found, const SE3& T_last_world,
                                  double gap_s);
  void stay_lost(TrackedFrame current, FrameEvidence evidence, const LocalView& view,
                 const SE3& T_last_world, TrackResult& result);
  /// What a lost camera sees becomes the start of a submap, if that is enough.
  /// @param T_last_world where it was last, if it ever was somewhere.
  void offer_submap(TrackedFrame current, const LocalView& view,
                    const std::optional<SE3>& T_last_world, TrackResult& result);
  [[nodiscard]] bool is_covered(const TrackedFrame& current, int usable, const LocalView& view,
                                const SE3& T_last_world) const;
  [[nodiscard]] KeyframeCandidate make_submap(TrackedFrame& frame, double reach_m,
                                              const LocalView& view);
  [[nodiscard]] bool starts_submaps() const {
    return config_.starts_submaps && config_.proposes_keyframes;
  }
  void deliver_place(const SE3& T_camera_world, const LocalView& view, TrackResult& result);
  void move_to(const SE3& T_camera_world, const SE3& T_last_world, bool was_lost, Timestamp stamp);
  [[nodiscard]] std::vector<std::uint8_t> free_space_violations(const TrackedFrame& current,
                                                                const FrameEvidence& evidence,
                                                                const PoseResult& pose,
                                                                const LocalView& view) const;
  [[nodiscard]] std::vector<TrackedObject> follow_objects(const FrameEvidence& evidence,
                                                          const TrackedFrame& current,
                                                          std::span<const SegmentationPtr> masks,
                                                          bool was_lost, const SE3& T_world_odom);
  void estimate_camera(const TrackedFrame& current, const SE3& T_camera_world,
                       const LocalView& view, TrackResult& result);
  /// Fills the result, with a candidate where a keyframe is due.
  void deliver(const PoseResult& pose, const LocalView& view, bool mapper_busy,
               TrackedFrame& current, TrackResult& result);
  TrackerConfig config_;
  const Camera& camera_;
  ShutterWatch shutter_;
  OrbExtractor orb_;
  PointClassifier classifier_;
  ObjectTracker objects_;
  PoseEstimator pose_estimator_;
  Relocalizer relocalizer_;
  MotionModel motion_model_;
  CameraEstimator calibration_;  // of TrackerConfig::calibrated
  Localization localization_;
  KeyframeProposer keyframes_;
  Rng rng_;

  TrackState state_ = TrackState::kWaiting;
  std::optional<TrackedFrame> last_;    // newest frame with a pose
  bool first_keyframe_is_due_ = false;  // a rolling shutter's waits for the second frame
  int weak_frames_ = 0;
  int frames_since_loss_ = 1 << 20;
  std::optional<Timestamp> fit_since_;  // lost, and what is seen would do for a submap
};

}  // namespace ygslam
