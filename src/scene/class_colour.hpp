// A colour for each class and object, so that files and pictures of a scene agree.
#pragma once

#include <span>

#include "image/image.hpp"
#include "scene/semantic_class.hpp"

namespace ygslam {

/// All that a SemanticClass can be, in ascending order; kUnknown last.
[[nodiscard]] std::span<const SemanticClass> all_semantic_classes();

/// No two classes have the same; none is white, which OctoMap takes for "no colour".
[[nodiscard]] Rgb8 class_colour(SemanticClass semantic_class);

/// Neighbours in number differ clearly; kNoSceneObject is grey.
[[nodiscard]] Rgb8 object_colour(SceneObjectId object);

}  // namespace ygslam
