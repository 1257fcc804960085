// A frame as it was seen, with what is known of its points.
#pragma once

#include <span>

#include "motion/classification/point_classifier.hpp"
#include "segment/segmenter.hpp"
#include "tracking/frame_features.hpp"

namespace ygslam {

struct ObservedFrame {
  FrameFeatures seen;
  FrameEvidence evidence;
  PointLabels labels;                      ///< of seen: their weights are its weights
  std::span<const SegmentationPtr> masks;  ///< that arrived with it
};

}  // namespace ygslam
