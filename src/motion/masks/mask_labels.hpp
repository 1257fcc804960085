// Labels of a frame's own features by that frame's own mask, edges mended with depth.
#pragma once

#include <cstdint>
#include <vector>

#include "image/image.hpp"
#include "motion/labels.hpp"
#include "segment/movable.hpp"

namespace ygslam {

struct MaskConfig {
  MovableClasses movable;
  double outer_band_px = 3;  ///< just outside: depth decides up to this far from the mask's edge
  double inner_band_px = 6;  ///< just inside: the same (networks draw masks a little too large)
  double same_depth_ratio =
      0.02;                       ///< just outside, at the object's depth up to this: on the object
  double behind_ratio = 0.06;     ///< just inside, farther than the object by this: background
  double far_behind_ratio = 0.3;  ///< the same anywhere inside (gaps between arm and body)
};

/// Depth of a frame at every fourth pixel: enough to tell an object from what is behind it, and
/// small enough to keep for many frames.
class CoarseDepth {
 public:
  static constexpr int kStep = 4;
  CoarseDepth() = default;
  explicit CoarseDepth(const DepthImage& depth_m);
  /// Depth [m] of the sample nearest to a pixel of the full image; 0 if none. Not finite counts as
  /// none.
  [[nodiscard]] float at(int u, int v) const {
    return samples_m_.contains(u / kStep, v / kStep) ? samples_m_.at(u / kStep, v / kStep) : 0.0F;
  }

 private:
  DepthImage samples_m_;
};

struct PointMask {
  SemanticLabel label = SemanticLabel::kUnknown;
  std::uint8_t instance = 0;  ///< Segmentation::ids value of the object, 0 = none
};

/// One entry per feature; all unknown if the mask has no pixels.
[[nodiscard]] std::vector<PointMask> label_by_mask(const Features& features,
                                                   const Segmentation& masks,
                                                   const CoarseDepth& depth_m,
                                                   const MaskConfig& config);

}  // namespace ygslam
