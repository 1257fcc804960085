// What the masks and the points of a frame tell the dense map about motion and things in it.
#pragma once

#include <span>

#include "dense/dense_frame.hpp"
#include "features/feature.hpp"
#include "motion/labels.hpp"
#include "segment/movable.hpp"

namespace ygslam {

/// Fills in movers (pixels of what can move by its class, and the surface around every
/// point that was seen to move), things with their detections, and the points' votes on their
/// motion.
/// @param masks nullptr: there is none, so no thing either.
/// @param labels of the features' points.
/// @param dense has its frame.
void mark_movers_and_things(const Segmentation* masks, const Features& features,
                            std::span<const MotionLabel> labels, const MovableClasses& movable,
                            DenseFrame& dense);

}  // namespace ygslam
