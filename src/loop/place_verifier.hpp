// Whether a view shows a place of the map: matches, a pose from them, and what speaks against it.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "geometry/camera.hpp"
#include "map/map.hpp"
#include "map/observation_noise.hpp"
#include "optim/pose_only.hpp"

namespace ygslam {

struct PlaceVerifierConfig {
  /// Wider than tracking's: the map's parts have drifted against each other. But wrong from 2.4 px
  /// on: a place that only nearly fits is another one.
  NoiseConfig noise = {.sigma_px = 1.0, .depth_sigma_scale = 10.0, .plane_depth_sigma_scale = 10.0};
  PoseOnlyConfig pose = {
      .rounds = 4, .gate_chi2_pixel = 5.991, .tail_dof = HUGE_VAL, .robust_rounds = 2};
  std::size_t window_keyframes = 10;  ///< covisible ones whose landmarks are searched, too
  int min_matches = 15;               ///< by descriptor alone
  int min_inliers = 25;               ///< landmarks that agree with the pose in the end
  double min_inlier_share = 0.35;     ///< of the landmarks matched near where the pose puts them
  int min_cells = 5;                  ///< of 4 x 4 image cells that inliers lie in
  double min_extent_m = 0.25;  ///< second standard deviation of the inliers: not all on one line
  double max_contradiction =
      0.15;  ///< share of points that one view has where the other saw through
};

/// What is compared with the map; of a keyframe or of a frame.
struct PlaceView {
  const Features& features;
  const FeatureGrid& grid;
  std::span<const float> static_weight;        ///< per feature
  const FreeSpaceImage* free_space = nullptr;  ///< null: not known
};
[[nodiscard]] inline PlaceView view_of(const Keyframe& keyframe) {
  return {*keyframe.data->features, keyframe.data->grid, keyframe.static_weight,
          &keyframe.data->free_space};
}

/// The first check that failed, in their order.
enum class PlaceVerdict : std::uint8_t {
  kFewMatches,
  kNoPose,
  kFewInliers,
  kNarrow,       ///< inliers in too few parts of the image or of space
  kContradicts,  ///< free space of one view is full in the other: moved, or another place
  kAgrees,
};
[[nodiscard]] const char* to_string(PlaceVerdict verdict);

struct PlaceMatch {
  KeyframeId place = kNoKeyframe;
  PlaceVerdict verdict = PlaceVerdict::kFewMatches;
  int matches = 0;  ///< by descriptor
  int guided = 0;   ///< near where the pose puts them
  int inliers = 0;
  double contradiction = 0;
  SE3 T_camera_world;  ///< from kFewInliers on
};

class PlaceVerifier {
 public:
  PlaceVerifier(const PlaceVerifierConfig& config, const Camera& camera)
      : config_(config), camera_(camera) {}

  /// @param seed of the sampling.
  [[nodiscard]] PlaceMatch verify(const Map& map, const PlaceView& view, KeyframeId place,
                                  std::uint64_t seed) const;
  /// The same from a known pose on: for views that stand beside a verified one.
  [[nodiscard]] PlaceMatch verify_near(const Map& map, const PlaceView& view, KeyframeId place,
                                       const SE3& T_guess_world) const;

 private:
  [[nodiscard]] std::optional<SE3> rough_pose(const Map& map, const PlaceView& view,
                                              std::span<const LandmarkId> landmarks,
                                              std::uint64_t seed, PlaceMatch& match) const;
  void judge_near(const Map& map, const PlaceView& view, std::span<const KeyframeId> window,
                  std::span<const LandmarkId> landmarks, const SE3& T_guess_world,
                  PlaceMatch& match) const;
  [[nodiscard]] double contradiction(const Map& map, const PlaceView& view,
                                     std::span<const KeyframeId> window,
                                     const SE3& T_camera_world) const;

  PlaceVerifierConfig config_;
  const Camera& camera_;
};

}  // namespace ygslam
