// Corners that are no points of the scene: where a near thing's outline crosses what is behind it.
// They move with the outline, but the surface they lie on stands still.
#pragma once

#include "motion/masks/mask_labels.hpp"

namespace ygslam {

struct OcclusionBoundaryConfig {
  bool enabled = true;
  double pyramid_scale = 1.2;  ///< between levels; the tracker sets it to that of its features
  double support_px = 3.0;     ///< radius a corner is measured over, at pyramid level 0
  double behind_ratio =
      0.08;  ///< farther than the nearest surface in its support by this: behind it
};

/// True for a feature without depth, or on the far side, beside a nearer surface.
[[nodiscard]] bool is_on_occlusion_boundary(const Feature& feature, const CoarseDepth& depth_m,
                                            const OcclusionBoundaryConfig& config);

}  // namespace ygslam
