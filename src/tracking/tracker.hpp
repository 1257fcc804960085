// The tracking stage: one frame in, its pose out (the paper's tracking thread).
#pragma once

#include <optional>
#include <span>

#include "core/rng.hpp"
#include "features/orb.hpp"
#include "geometry/camera.hpp"
#include "geometry/motion_model.hpp"
#include "inertial/pose_prediction.hpp"
#include "map/local_view.hpp"
#include "map/messages.hpp"
#include "objects/object_tracker.hpp"
#include "tracking/coasting.hpp"
#include "tracking/ego_mask_watch.hpp"
#include "tracking/feature_follower.hpp"
#include "tracking/free_space_check.hpp"
#include "tracking/keyframe_proposer.hpp"
#include "tracking/localization.hpp"
#include "tracking/observed_frame.hpp"
#include "tracking/pose_search.hpp"
#include "tracking/screen_watch.hpp"
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
  FollowConfig follow;
  EgoMaskConfig ego_mask;
  ScreenConfig screens;
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

  /// A frame before anything is known of what moves in it: all that does not wait for its mask.
  struct SeenFrame {
    FrameFeatures features;
    PredictedMotion motion;
    std::optional<PosePrediction> inertial;
    std::optional<FlowPrediction> predicted_ends;
    FrameFlow flow;
    double orb_ms = 0;
  };
  /// @param predicted by an IMU or wheels, if there are any.
  [[nodiscard]] SeenFrame look(const FramePtr& frame,
                               const std::optional<PosePrediction>& predicted = {});
  /// @param seen what look() gave last.
  /// @param view the newest published view (may be empty before the first keyframe is mapped).
  /// @param masks that arrived since the last call, of this or earlier frames.
  /// @param mapper_busy spares the mapper all but indispensable keyframes.
  [[nodiscard]] TrackResult step(SeenFrame seen, const LocalViewPtr& view,
                                 std::span<const SegmentationPtr> masks, bool mapper_busy);
  [[nodiscard]] TrackResult step(const FramePtr& frame, const LocalViewPtr& view,
                                 std::span<const SegmentationPtr> masks, bool mapper_busy) {
    return step(look(frame), view, masks, mapper_busy);
  }

  /// Of the next frame, in place of what the motion model predicts: the camera's motion since the
  /// frame before, by whoever measures it. Passed over where that frame has no pose.
  void expect_motion(const SE3& T_now_last) { expected_motion_ = T_now_last; }

 private:
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
  [[nodiscard]] TrackResult start(ObservedFrame now, const LocalViewPtr& view);
  /// The same of a run that goes on with a map: found there, or lost.
  [[nodiscard]] TrackResult start_in_map(ObservedFrame now, const LocalViewPtr& view);
  /// @param T_now_last the camera's motion since its last pose, as predicted.
  /// @param inertial the whole prediction, if an IMU or wheels made it.
  [[nodiscard]] TrackResult track(ObservedFrame now, const SE3& T_now_last,
                                  const std::optional<PosePrediction>& inertial,
                                  const LocalViewPtr& view, bool mapper_busy);
  [[nodiscard]] TrackResult coast(ObservedFrame now, const LocalViewPtr& view,
                                  const PoseSearch::Guess& guess,
                                  std::optional<KeyframeCandidate> first_keyframe);
  /// Coasting it sees what the map does not know: mapping goes on from where the IMU says it is.
  [[nodiscard]] std::optional<KeyframeCandidate> map_on(FrameFeatures seen, bool too_few_static,
                                                        const LocalViewPtr& view,
                                                        const PoseSearch::Guess& guess);
  [[nodiscard]] TrackResult stay_lost(ObservedFrame now, const LocalViewPtr& view,
                                      const SE3& T_last_world,
                                      std::optional<KeyframeCandidate> first_keyframe);
  /// What is told of the newest frame with a pose.
  [[nodiscard]] TrackResult tracked(const Localization::Place& place, const PoseResult& pose,
                                    PointLabels labels, std::vector<TrackedObject> objects,
                                    MapRequest request, CameraFindings camera) const;

  /// What is known of pixels that are not of the world, and what follows from it.
  void tell_of_mask(const RgbdFrame& frame, const LocalView& view, TrackResult& result);

  // Steps on these ways, in their order.
  [[nodiscard]] PredictedMotion predicted_motion(const RgbdFrame& frame,
                                                 const std::optional<PosePrediction>& inertial);
  [[nodiscard]] std::optional<FlowPrediction> predicted_flow(const PredictedMotion& motion) const;
  [[nodiscard]] FrameFeatures see(const FramePtr& frame,
                                  const std::optional<FlowPrediction>& predicted,
                                  const FrameFlow& flow);
  [[nodiscard]] ObservedFrame observe(FrameFeatures seen, std::span<const SegmentationPtr> masks,
                                      const std::optional<FlowPrediction>& predicted,
                                      FrameFlow flow);
  [[nodiscard]] std::optional<KeyframeCandidate> late_first_keyframe(
      std::optional<FrameFeatures> first_seen);
  [[nodiscard]] Localization::Arrival arrive(const Localization::Step& step, const LocalView& view);
  [[nodiscard]] std::vector<TrackedObject> follow_objects(const ObservedFrame& now, bool was_lost,
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
  OrbExtractor orb_;
  FeatureFollower follower_;
  PointClassifier classifier_;
  ObjectTracker objects_;
  PoseEstimator pose_estimator_;
  EgoMaskWatch ego_mask_;
  ScreenWatch screens_;
  MotionModel motion_model_;
  PoseSearch search_;
  CameraEstimator calibration_;  // of TrackerConfig::calibrated
  Localization localization_;
  TrackJudge judge_;
  SubmapStarter submaps_;
  KeyframeProposer keyframes_;
  Coasting coasting_;
  Rng rng_;

  std::optional<TrackedFrame> last_;    // newest frame with a pose
  std::optional<SE3> expected_motion_;  // of the next frame
  bool first_keyframe_is_due_ = false;  // a rolling shutter's waits for the second frame
};

}  // namespace ygslam
