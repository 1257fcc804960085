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
#include "tracking/ego_mask.hpp"
#include "tracking/free_space_check.hpp"
#include "tracking/keyframe_proposer.hpp"
#include "tracking/known_screens.hpp"
#include "tracking/localization.hpp"
#include "tracking/pose_estimator.hpp"
#include "tracking/relocalizer.hpp"
#include "tracking/retracker.hpp"
#include "tracking/screen_finder.hpp"
#include "tracking/shutter_watch.hpp"
#include "tracking/submap_starter.hpp"
#include "tracking/track_judge.hpp"
#include "tracking/track_result.hpp"
#include "tracking/tracked_frame.hpp"

namespace ygslam {

struct TrackerConfig {
  PoseEstimatorConfig pose;
  MotionModelConfig motion_model;
  TrackJudgeConfig judge;
  KeyframePolicyConfig keyframe;
  RelocalizerConfig relocalizer;
  FreeSpaceConfig free_space;
  EgoMaskConfig ego_mask;
  ObjectConfig objects;
  /// What of the camera is looked for in place of an unknown read-out time. Not a setting.
  std::vector<CameraParameter> calibrated{};
  bool proposes_keyframes = true;  ///< false: frames are only placed. Not a setting.
  bool starts_submaps = true;      ///< false: a lost camera waits for a place it knows
  int min_start_points = 100;      ///< static features with depth in the first frame
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

  /// Of the next frame, in place of what the motion model predicts: the camera's motion since the
  /// frame before, by whoever measures it. Passed over where that frame has no pose.
  void expect_motion(const SE3& T_now_last) { expected_motion_ = T_now_last; }

 private:
  /// A frame as it was seen.
  struct Observed {
    FrameFeatures seen;
    FrameEvidence evidence;
    PointLabels labels;  // of seen, their weights are its weights
    std::span<const SegmentationPtr> masks;
  };
  struct FoundPose {
    FrameFeatures seen;  // corrected by the velocity that the pose shows
    std::optional<PoseResult> pose{};
    PoseJump jump{};
    /// The frame before, corrected by the same: the run's first has no velocity of its own.
    std::optional<FrameFeatures> first_seen{};
  };
  struct MapRequest {
    std::optional<KeyframeCandidate> candidate;
    std::optional<KeyframeId> wanted_view;
  };
  struct CameraFindings {
    std::optional<ShutterReport> shutter;
    std::optional<ReadOut> guessed_read_out;
    std::optional<CameraEstimator::Estimate> estimate;
  };

  // The ways of a frame that was observed.
  /// None had a place before it: it is the start of the world, if it shows enough.
  [[nodiscard]] TrackResult start(Observed now, const LocalViewPtr& view);
  /// The same of a run that goes on with a map: found there, or lost.
  [[nodiscard]] TrackResult start_in_map(Observed now, const LocalViewPtr& view);
  /// @param T_now_last the camera's motion since its last pose, by the motion model.
  [[nodiscard]] TrackResult track(Observed now, const SE3& T_now_last, const LocalViewPtr& view,
                                  bool mapper_busy);
  [[nodiscard]] TrackResult stay_lost(Observed now, const LocalViewPtr& view,
                                      const SE3& T_last_world,
                                      std::optional<KeyframeCandidate> first_keyframe);
  /// What is told of the newest frame with a pose.
  [[nodiscard]] TrackResult tracked(const Localization::Place& place, const PoseResult& pose,
                                    PointLabels labels, std::vector<TrackedObject> objects,
                                    MapRequest request, CameraFindings camera) const;

  /// What is known of pixels that are not of the world, and what follows from it.
  void tell_of_mask(const RgbdFrame& frame, const LocalView& view, TrackResult& result);

  // Steps on these ways, in their order.
  [[nodiscard]] PredictedMotion predicted_motion(const RgbdFrame& frame);
  [[nodiscard]] std::optional<FlowPrediction> predicted_flow(const PredictedMotion& motion) const;
  [[nodiscard]] FrameFeatures see(const FramePtr& frame,
                                  const std::optional<FlowPrediction>& predicted);
  [[nodiscard]] FrameFeatures corrected(FrameFeatures seen, const Vec6& body_velocity) const;
  [[nodiscard]] Observed observe(FrameFeatures seen, std::span<const SegmentationPtr> masks,
                                 const std::optional<FlowPrediction>& predicted);
  [[nodiscard]] SE3 last_pose(const LocalView& view);
  [[nodiscard]] FoundPose find_pose(const FrameFeatures& seen, const LocalView& view,
                                    const SE3& T_last_world, const SE3& T_guess_world);
  [[nodiscard]] FoundPose follow(const FrameFeatures& seen, const LocalView& view,
                                 const SE3& T_last_world, const SE3& T_guess_world);
  [[nodiscard]] std::optional<KeyframeCandidate> late_first_keyframe(
      std::optional<FrameFeatures> first_seen);
  [[nodiscard]] Localization::Arrival arrive(const Localization::Step& step, const LocalView& view);
  /// What is on a screen that plays is labelled so, where the camera is about to be.
  [[nodiscard]] Observed with_known_screens(Observed now, const SE3& T_now_last) const;
  [[nodiscard]] Observed labelled_by_screens(Observed now, const SE3& T_odom_camera) const;
  /// Screens found with the pose: where one had moved the camera, the pose without it.
  /// @return the frame's observation and pose as they are then.
  [[nodiscard]] FoundPose look_for_screens(Observed& now, FoundPose found, const LocalView& view,
                                           const SE3& T_last_world);
  [[nodiscard]] std::vector<Vec3> moving_unmasked(const Observed& now) const;
  /// How many points move that are on nothing known to.
  [[nodiscard]] int unexplained_motions(const Observed& now) const;
  [[nodiscard]] std::vector<ScreenFinder::Point> points_before(const Observed& now,
                                                               const PoseResult& pose,
                                                               const LocalView& view,
                                                               const SE3& T_last_world) const;
  void follow_screens(const Observed& now);
  [[nodiscard]] Observed compared_with_map(Observed now, const PoseResult& pose,
                                           const LocalView& view) const;
  [[nodiscard]] std::vector<TrackedObject> follow_objects(const Observed& now, bool was_lost,
                                                          const SE3& T_world_odom);
  [[nodiscard]] MapRequest ask_mapper(const PoseResult& pose, Localization::Arrival arrival,
                                      bool mapper_busy);
  [[nodiscard]] CameraFindings estimate_camera();
  /// What a lost camera sees becomes the start of a submap, if that is enough.
  /// @param T_last_world where it was last, if it ever was somewhere.
  [[nodiscard]] std::optional<KeyframeCandidate> offer_submap(
      FrameFeatures seen, bool too_few_static, const LocalViewPtr& view,
      const std::optional<SE3>& T_last_world);

  TrackerConfig config_;
  const Camera& camera_;
  ShutterWatch shutter_;
  EgoMask ego_mask_;
  OrbExtractor orb_;
  PointClassifier classifier_;
  ObjectTracker objects_;
  PoseEstimator pose_estimator_;
  Relocalizer relocalizer_;
  Retracker retracker_;
  ScreenFinder screen_finder_;
  KnownScreens screens_;
  MotionModel motion_model_;
  CameraEstimator calibration_;  // of TrackerConfig::calibrated
  Localization localization_;
  TrackJudge judge_;
  SubmapStarter submaps_;
  KeyframeProposer keyframes_;
  Rng rng_;

  std::optional<TrackedFrame> last_;    // newest frame with a pose
  std::optional<SE3> expected_motion_;  // of the next frame
  bool first_keyframe_is_due_ = false;  // a rolling shutter's waits for the second frame
};

}  // namespace ygslam
