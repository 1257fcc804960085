// Pyramidal Lucas-Kanade flow of sparse points (Lucas and Kanade 1981; Bouguet 2000; the paper's
// III.C) with the paper's check of every end: not near the border, 3x3 patch alike.
#pragma once

#include <span>
#include <vector>

#include "motion/flow/image_pyramid.hpp"
#include "motion/labels.hpp"

namespace ygslam {

struct FlowConfig {
  /// Side of the square that moves as one, odd. 15 costs 1.6 times as much and labels no better.
  int window_px = 11;
  int levels = 3;                ///< halvings of the image
  int max_iterations = 10;       ///< per point and level
  double epsilon_px = 0.03;      ///< a step shorter than this ends the iteration
  double min_eigenvalue = 1e-3;  ///< of the normalised gradient matrix; less texture: no flow
  double patch_diff = 25;  ///< mean absolute difference of the 3x3 patches [grey levels] above
                           ///< which a point is dropped
  double border_px = 8;    ///< ends nearer to the border are dropped
};

enum class FlowStatus : std::uint8_t {
  kFound,
  kLost,    ///< no texture, left the image, or not finite
  kBorder,  ///< ended too near to the border
  kPatch,   ///< ended on something that looks different
};

struct FlowPoint {
  Eigen::Vector2f end_uv_px = Eigen::Vector2f::Zero();  ///< meaningful where status is not kLost
  FlowStatus status = FlowStatus::kLost;
  float patch_diff = 0;  ///< mean absolute difference of the 3x3 patches [grey levels]
};

/// Flow of points of the previous image into the current one.
/// @param guesses_uv_px empty, or where each point is expected in the current image (not finite: no
/// guess). @return one entry per point.
[[nodiscard]] std::vector<FlowPoint> track_points(const ImagePyramid& previous,
                                                  const ImagePyramid& current,
                                                  std::span<const Eigen::Vector2f> points_uv_px,
                                                  std::span<const Eigen::Vector2f> guesses_uv_px,
                                                  const FlowConfig& config);

/// The ends as link_to_previous() wants them.
[[nodiscard]] std::vector<FlowEnd> flow_ends(std::span<const FlowPoint> flow);

}  // namespace ygslam
