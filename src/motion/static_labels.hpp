// One label and one weight per feature out of what masks, the epipolar check and the point's own
// past say about it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "motion/labels.hpp"
#include "motion/mask_propagation.hpp"
#include "motion/motion_consistency.hpp"
#include "motion/point_anchors.hpp"
#include "motion/rigid_flow.hpp"

namespace ygslam {

enum class DynamicMode : std::uint8_t {
  kOff,       ///< everything is static (the ORB-SLAM2 base)
  kGeometry,  ///< motion alone: epipolar line, depth, anchors
  kSemantic,  ///< masks only
  kFull,      ///< both
};

/// Whether geometry has a say: flow, depth and the memory of empty space.
[[nodiscard]] constexpr bool uses_geometry(DynamicMode mode) {
  return mode == DynamicMode::kGeometry || mode == DynamicMode::kFull;
}

struct FusionConfig {
  bool second_look = true;  ///< judge every point again against the pose found from the map
  /// Features at which no flow ends are judged as the flow ends around them at their depth; false:
  /// they stay unknown, as in the paper.
  bool ask_neighbours = true;
  double min_moving_share = 0.3;      ///< of the neighbours; below, a violator is only doubtful
  double neighbour_majority = 0.7;    ///< share of the neighbours' votes that must agree
  double unknown_weight = 0.6;        ///< of a point nobody has said anything about
  double max_dynamic_share = 0.7;     ///< a check that flags more than this is not believed
  double min_fit_quality = 0.3;       ///< ... nor one whose voters disagreed this much
  int min_static = 60;                ///< fewer usable points: the least suspicious come back
  double recalled_weight_high = 0.5;  ///< of the least suspicious of those
  double recalled_weight_low = 0.1;   ///< of the most suspicious
  double sure_mover_factor =
      4.0;  ///< inside a mask and this many limits off its line: never recalled
};

/// Beyond these a point moves.
struct FusionLimits {
  double tau_px = 1.0;        ///< MotionConfig::tau_px
  double limit_tau_px = 1.0;  ///< MotionConfig::limit_tau_px
  double rigid_px = 2.0;      ///< RigidFit::limit_px
  double anchor_px = 3.0;     ///< AnchorJudgement::limit_px
};

/// All that is known about one feature of the current frame.
struct PointEvidence {
  SemanticPoint semantic{};
  float epipolar_px = -1;   ///< D of eq. (16) of the flow that ends at it; -1 = not judged
  float moving_share = -1;  ///< of the neighbours' votes, -1 = not asked
  RigidResidual rigid{};    ///< of the same flow
  AnchorResidual anchor{};  ///< of the same point over a longer time
  bool rests = false;       ///< on an object that demonstrably stands still
  bool on_rim = false;      ///< behind an outline, see occlusion_rim.hpp
  bool intrudes = false;    ///< in space that the map knows to be empty
  MotionLabel previous = MotionLabel::kUnknown;  ///< final label of the feature it continues
};

struct StaticLabels {
  std::vector<MotionLabel> label;
  std::vector<float> weight;     ///< 0..1: how far to trust the point in the pose; 0 for dynamic
  std::vector<float> suspicion;  ///< 0 = none; above 1 a point is dynamic
  int static_points = 0, dynamic_points = 0, unknown_points = 0;
  bool too_few_static = false;  ///< fewer than min_static points were left
  int recalled = 0;             ///< points that came back because of that, label unknown
  bool check_believed = false;  ///< the epipolar check counted in full
};

/// @param check the epipolar check's summary; its distances come with the evidence.
[[nodiscard]] StaticLabels fuse(DynamicMode mode, std::span<const PointEvidence> evidence,
                                const MotionCheck& check, const FusionLimits& limits,
                                const FusionConfig& config);

/// Counts the labels anew, after a change.
void count(StaticLabels& labels);

/// Labels of n points that nobody judges: all static with weight 1.
[[nodiscard]] StaticLabels all_static(std::size_t n);

}  // namespace ygslam
