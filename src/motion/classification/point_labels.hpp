// One label and one weight per feature out of what masks, the checks of motion and the point's own
// past say about it: the one place where "static" is decided.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/ids.hpp"
#include "motion/checks/ego_motion.hpp"
#include "motion/checks/epipolar_check.hpp"
#include "motion/labels.hpp"
#include "motion/masks/label_history.hpp"

namespace ygslam {

enum class DynamicMode : std::uint8_t {
  kOff,       ///< everything is static (the ORB-SLAM2 base)
  kGeometry,  ///< motion alone: epipolar line and depth
  kSemantic,  ///< masks only
  kFull,      ///< both
};

/// "off", "geometry", "semantic", "full".
[[nodiscard]] const char* mode_name(DynamicMode mode);

/// Whether geometry has a say: flow, depth and the map's free space.
[[nodiscard]] constexpr bool uses_geometry(DynamicMode mode) {
  return mode == DynamicMode::kGeometry || mode == DynamicMode::kFull;
}
[[nodiscard]] constexpr bool uses_masks(DynamicMode mode) {
  return mode == DynamicMode::kSemantic || mode == DynamicMode::kFull;
}

struct ClassifierConfig {
  /// Features at which no flow ends are classified as the flow ends around them at their depth;
  /// false: they stay unknown, as in the paper.
  bool vote_of_neighbours = true;
  double min_moving_share = 0.3;    ///< of the neighbours; below, a violation is only a doubt
  double neighbour_majority = 0.7;  ///< share of the neighbours' votes that must agree
  double unknown_weight = 0.6;      ///< of a point nobody has said anything about
  double min_fit_quality = 0.3;     ///< a check whose candidates disagreed this much
  int min_static = 60;              ///< fewer usable points: those with the lowest score come back
  double fallback_weight_high = 0.5;  ///< of those with the lowest score
  double fallback_weight_low = 0.1;   ///< of those with the highest
};

/// Beyond these a point moves.
struct MotionLimits {
  double tau_px = 1.0;         ///< EpipolarConfig::tau_px
  double ego_motion_px = 2.0;  ///< EgoMotion::limit_px
};

/// All that is known about one feature of the current frame.
struct PointEvidence {
  SemanticPoint semantic{};
  float epipolar_px = -1;          ///< D of eq. (16) of the flow that ends at it; -1 = not judged
  float moving_share = -1;         ///< of the neighbours' votes, -1 = not asked
  EgoMotionResidual ego_motion{};  ///< of the same flow
  bool rests = false;              ///< on an object that demonstrably stands still
  bool on_boundary = false;        ///< behind an outline, see occlusion_boundary.hpp
  bool in_free_space = false;      ///< in space that the map knows to be empty
  bool on_screen = false;          ///< on a screen that plays
  MotionLabel previous = MotionLabel::kUnknown;  ///< final label of the feature it continues
};

struct PointLabels {
  std::vector<MotionLabel> label;
  std::vector<float> weight;  ///< 0..1: how far to trust the point in the pose; 0 for dynamic
  std::vector<float> dynamic_score;  ///< 0 = none; above 1 a point is dynamic
  int static_points = 0, dynamic_points = 0, unknown_points = 0;
  bool too_few_static = false;  ///< fewer than min_static points were left
  int fallback_points = 0;      ///< points that came back because of that, label unknown
  bool check_believed = false;  ///< the epipolar check counted in full
};

/// @param check the epipolar check's summary; its distances come with the evidence.
[[nodiscard]] PointLabels classify(DynamicMode mode, std::span<const PointEvidence> evidence,
                                   const EpipolarCheck& check, const MotionLimits& limits,
                                   const ClassifierConfig& config);

/// What agrees with a landmark of the static map is static.
/// @param landmarks per label, kNoLandmark where none agrees.
[[nodiscard]] PointLabels promote(PointLabels labels, std::span<const LandmarkId> landmarks);

/// Labels of n points that nothing is checked of: all static with weight 1.
[[nodiscard]] PointLabels all_static(std::size_t n);

}  // namespace ygslam
