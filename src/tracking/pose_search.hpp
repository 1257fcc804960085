// Where the camera is: from frame to frame and on to the map, or by the map alone.
#pragma once

#include <optional>

#include "core/rng.hpp"
#include "geometry/motion_model.hpp"
#include "tracking/map_rival.hpp"
#include "tracking/observed_frame.hpp"
#include "tracking/relocalizer.hpp"
#include "tracking/screen_watch.hpp"
#include "tracking/shutter_watch.hpp"
#include "tracking/track_judge.hpp"

namespace ygslam {

struct FoundPose {
  FrameFeatures seen;  // corrected by the velocity that the pose shows
  std::optional<PoseResult> pose{};
  PoseJump jump{};
  /// The frame before, corrected by the same: the run's first has no velocity of its own.
  std::optional<FrameFeatures> first_seen{};
};

class PoseSearch {
 public:
  /// What it works with; all of it must outlive it.
  struct Tools {
    const Camera& camera;
    const ShutterWatch& shutter;
    const PointClassifier& classifier;
    const PoseEstimator& estimator;
    const MotionModel& motion_model;
  };
  /// @param least_inliers fewer are followed no further.
  PoseSearch(const Tools& tools, const RelocalizerConfig& relocalizer, int least_inliers);

  /// What it goes out from.
  struct From {
    const TrackedFrame& last;  ///< with a pose
    TrackState state;          ///< of the frame before
    bool first_keyframe_is_due;
    const LocalView& view;
  };
  /// Where the camera is looked for, and what is known of it before.
  struct Guess {
    SE3 T_last_world, T_guess_world;  // of the last frame with a pose, of this one
    std::optional<PosePrediction> inertial;
  };
  /// T_last_world in the map as the view has it.
  /// @param last told relative to itself where it has become a keyframe.
  [[nodiscard]] SE3 last_pose(TrackedFrame& last, const LocalView& view) const;
  [[nodiscard]] FoundPose step(const FrameFeatures& seen, const From& from, const Guess& guess,
                               Rng& rng);
  /// By what it sees alone.
  [[nodiscard]] std::optional<PoseResult> relocalised(const FrameFeatures& seen,
                                                      const LocalView& view, Rng& rng) {
    return relocalizer_.step(seen, view, rng);
  }
  /// Where what was followed says little: the map's pose, if it has another.
  /// @param now labelled anew then.
  [[nodiscard]] FoundPose held_against_map(ObservedFrame& now, FoundPose found, const From& from,
                                           const Guess& guess) const;
  /// Where a screen had moved the camera: the pose without it.
  /// @param now labelled anew then.
  [[nodiscard]] FoundPose held_against_screens(ObservedFrame& now, FoundPose found,
                                               const From& from, const Guess& guess,
                                               ScreenWatch& screens, Rng& rng);

 private:
  [[nodiscard]] static PoseJump jump_of(const SE3& T_camera_world, const FrameFeatures& seen,
                                        const TrackedFrame& last, const Guess& guess);
  [[nodiscard]] FoundPose follow(const FrameFeatures& seen, const From& from, const Guess& guess,
                                 Rng& rng) const;

  Tools tools_;
  Relocalizer relocalizer_;
  MapRival map_rival_;
  int confirmed_;  // inliers of the map, of a pose after a loss
  int least_inliers_;
};

/// The same by a prediction that leaves out what vision said last.
[[nodiscard]] PoseSearch::Guess without_newest(PoseSearch::Guess guess, const SE3& T_odom_last);

[[nodiscard]] InertialVerdict verdict_on(const std::optional<PoseResult>& pose,
                                         const PoseSearch::Guess& guess);

}  // namespace ygslam
