// Camera pose of a frame in two steps: against the previous frame, then against the local map.
#pragma once

#include <optional>
#include <vector>

#include "core/rng.hpp"
#include "features/pyramid_scales.hpp"
#include "geometry/camera.hpp"
#include "map/local_view.hpp"
#include "map/messages.hpp"
#include "map/observation_noise.hpp"
#include "map/projection_matcher.hpp"
#include "optim/pose_only.hpp"
#include "tracking/tracked_frame.hpp"

namespace ygslam {

struct PoseEstimatorConfig {
  PoseOnlyConfig pose;
  NoiseConfig noise;
  double search_last_px = 15;        ///< window around the prediction, level 0
  double search_wide_px = 45;        ///< second try
  double search_map_px = 3;          ///< window around the refined pose, level 0
  int min_matches = 15;              ///< below: the next wider search
  double max_temporary_depth_m = 5;  ///< points of the last frame that are not in the map yet
  bool use_local_map = true;  ///< false: only the previous frame and its landmarks (ablation)
};

struct PoseResult {
  SE3 T_camera_world;
  std::vector<LandmarkId> landmarks;  ///< per feature: landmark it agrees with
  int landmark_inliers = 0;           ///< features that agree with a landmark
  int inliers = 0;                    ///< of these and of points of the previous frame
  int matches = 0;                    ///< of the final step
  bool contested = false;             ///< another pose explains as much, see ScreenFinder
  double position_std_m = 0;          ///< of the camera centre, by the residuals' curvature
  /// Of the twist xi of exp(xi) * T_camera_world [m, rad], as far as the points determine it.
  std::optional<Mat6> covariance;
  std::vector<KeyframeCandidate::Seen> seen;  ///< landmarks predicted in view
};

class PoseEstimator {
 public:
  PoseEstimator(const PoseEstimatorConfig& config, const Camera& camera,
                const PyramidScales& scales);

  [[nodiscard]] const Camera& camera() const { return camera_; }

  /// A match of a feature with a point of the map or of the previous frame.
  struct Pairing {
    Vec3 p_world;
    std::uint32_t feature;
    LandmarkId landmark;
  };
  /// What the first step found.
  struct FirstPose {
    PoseSolution solution;
    std::vector<Pairing> pairings;
    /// The features were looked for in this very view before: it has no more for them.
    bool knows_map = false;
  };

  /// The first step, against the previous frame.
  /// @param frame features, grid and weights of the current frame. Those that were followed from
  /// the previous frame's go with their points.
  /// @param last the previous tracked frame at T_last_world. @param view may be empty.
  /// @param T_guess_world predicted pose T_camera_world of the current frame.
  /// @return nullopt if no pose explains enough points.
  [[nodiscard]] std::optional<FirstPose> match_previous_frame(
      const FrameFeatures& frame, const TrackedFrame& last, const SE3& T_last_world,
      const LocalView& view, const SE3& T_guess_world, Rng& rng) const;
  /// The second step, against the local map; once more where that moved the pose so far that the
  /// search windows were off.
  [[nodiscard]] std::optional<PoseResult> match_map(const FrameFeatures& frame,
                                                    const LocalView& view,
                                                    const FirstPose& first) const;
  /// The second step alone, from a good guess (used after relocalisation).
  [[nodiscard]] std::optional<PoseResult> refine_on_map(const FrameFeatures& frame,
                                                        const LocalView& view,
                                                        const SE3& T_guess_world) const;
  /// From a prediction, by the map alone: what has come before the camera since is not in it.
  [[nodiscard]] std::optional<PoseResult> match_predicted(const FrameFeatures& frame,
                                                          const LocalView& view,
                                                          const SE3& T_guess_world) const;
  /// Pose in a corrected map of a frame that was posed before: it moves as its landmarks did.
  /// @param frame with view, landmarks and T_camera_world as they were then.
  /// @param T_guess_world its pose in view, about.
  /// @return nullopt if too few landmarks are left.
  [[nodiscard]] std::optional<SE3> follow_landmarks(const TrackedFrame& frame,
                                                    const LocalView& view,
                                                    const SE3& T_guess_world) const;

 private:
  [[nodiscard]] Pairing known_point(const TrackedFrame& last, std::uint32_t source,
                                    const SE3& T_world_last, const LocalView& view) const;
  /// Whether a point of the previous frame may tell the pose of this one.
  [[nodiscard]] bool is_usable(const TrackedFrame& last, std::uint32_t source,
                               const LocalView& view) const;
  /// Features that were followed from points of the previous frame.
  [[nodiscard]] std::vector<Pairing> along_flow(const FrameFeatures& frame,
                                                const TrackedFrame& last, const SE3& T_last_world,
                                                const LocalView& view) const;
  [[nodiscard]] std::vector<Pairing> match_last(const FrameFeatures& frame,
                                                const TrackedFrame& last, const SE3& T_last_world,
                                                const LocalView& view, const SE3& T_guess_world,
                                                double radius_px) const;
  [[nodiscard]] std::vector<Pairing> match_last_by_descriptor(const FrameFeatures& frame,
                                                              const TrackedFrame& last,
                                                              const SE3& T_last_world,
                                                              const LocalView& view) const;
  [[nodiscard]] std::optional<PoseSolution> solve(const FrameFeatures& frame,
                                                  const std::vector<Pairing>& pairings,
                                                  const SE3& T_guess_world) const;
  [[nodiscard]] std::optional<PoseResult> refine(const FrameFeatures& frame, const LocalView& view,
                                                 const FirstPose& first, double radius_px) const;
  void add_map_matches(const FrameFeatures& frame, const LocalView& view, const SE3& T_camera_world,
                       double radius_px, std::vector<Pairing>& pairings,
                       std::vector<KeyframeCandidate::Seen>& seen) const;

  PoseEstimatorConfig config_;
  const Camera& camera_;
  PyramidScales scales_;
};

}  // namespace ygslam
