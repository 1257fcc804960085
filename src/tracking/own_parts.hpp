// Instances that a network saw in what is fixed to the camera: a robot's arm taken for a person.
#pragma once

#include "image/pixel_mask.hpp"
#include "segment/segmenter.hpp"

namespace ygslam {

/// The masks without instances that lie mostly on pixels which are not of the world: the same where
/// there are none. @param pixels null = none. @param masks may be null.
[[nodiscard]] SegmentationPtr without_own_parts(const SegmentationPtr& masks,
                                                const PixelMaskPtr& pixels);

}  // namespace ygslam
