// Motion consistency check: Algorithm 1 of the paper (III.D). Flow of the previous frame's points,
// the fundamental matrix from those that were static there (image prior), and each point's distance
// from its epipolar line.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "geometry/epipolar.hpp"
#include "motion/labels.hpp"

namespace ygslam {

/// Which corners of the previous frame are followed and judged.
enum class FlowCorners : std::uint8_t {
  kOrb,     ///< the features themselves (the paper)
  kHarris,  ///< Harris corners of their own (the classic check, DS-SLAM)
};

struct EpipolarConfig {
  bool prior =
      true;  ///< F from points static in the previous frame only; false = all vote (classic)
  FlowCorners corners = FlowCorners::kOrb;
  double tau_px = 1.0;        ///< farther from its line a point is dynamic (tau = limit_tau)
  double link_radius_px = 2;  ///< a feature takes the label of the nearest flow end within
  int min_static = 20;        ///< fewer candidates: no verdict
  RansacConfig ransac{};
};

enum class CheckState : std::uint8_t {
  kNotRun,
  kTooFewStatic,  ///< fewer than min_static candidates were followed
  kNoFit,         ///< the candidates do not agree on an F
  kDone,
};

struct EpipolarLabel {
  MotionLabel label = MotionLabel::kUnknown;
  float distance_px = -1;  ///< D of eq. (16); negative: not judged
};

struct EpipolarCheck {
  CheckState state = CheckState::kNotRun;
  std::optional<Mat3> F;              ///< P2^T F P1 = 0, 1 = previous, 2 = current, ideal pixels
  std::vector<EpipolarLabel> points;  ///< per point handed in
  int candidates = 0;                 ///< points F was fitted from
  int inliers = 0;                    ///< of them
  /// 0..1: how far "violates F" speaks for a moving point. Small where the candidates disagreed.
  double fit_quality = 0;
};

/// @param flow previous and current ideal pixel of each followed point; not finite = not followed.
/// @param previous_label of the same points in the previous frame; same size as flow.
[[nodiscard]] EpipolarCheck check_epipolar(std::span<const PointPair> flow,
                                           std::span<const MotionLabel> previous_label,
                                           const EpipolarConfig& config, Rng& rng);

}  // namespace ygslam
