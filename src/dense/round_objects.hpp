// Objects that look alike from all sides: bottles, cups, bowls, plants, balls.
#pragma once

#include <span>

#include "dense/object_observation.hpp"
#include "scene/semantic_class.hpp"
#include "volume/depth_view.hpp"
#include "volume/prepared_view.hpp"

namespace ygslam {

/// Whether objects of the class look alike when they are turned about the upright.
[[nodiscard]] bool is_round(SemanticClass semantic_class);

/// What is seen of a round object, but of a plant, is half as deep as it is wide: the pixels of its
/// mask out of the range of depth (that long, and the noise at either end) that holds most of them
/// become DepthView::kUnsure. Masks of small objects reach over what stands before them or behind.
/// @param view objects are numbers of detections, from 1.
void drop_beyond_round_objects(DepthView& view, std::span<const Detection> detections,
                               const DepthNoise& noise);

}  // namespace ygslam
