// Calls a segmenter and checks what it returns: whatever it does, the run goes on.
#pragma once

#include "segment/segmenter.hpp"

namespace ygslam {

/// Calls the segmenter. @return an error (kModel, one line) if it throws anything, or if what it
/// returns is no segmentation of this frame: tagged with another frame, ids not of the image's size
/// or without an instance, boxes or scores that are not finite.
[[nodiscard]] Result<Segmentation> segment_safely(Segmenter& segmenter, const RgbdFrame& frame);

}  // namespace ygslam
