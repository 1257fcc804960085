// Which classes can move is configuration: COCO names and groups of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "segment/segmenter.hpp"

namespace ygslam {

/// @param names COCO class names ("person", "dog") and groups: "animals", "vehicles", "handheld"
/// (what people carry, lift or play with), "furniture" (what people move now and then).
/// @return class ids, ascending, each once; an unknown name is an error that names the nearest.
[[nodiscard]] Result<std::vector<int>> movable_classes(std::span<const std::string> names);

/// Persons and animals: what is no part of a room, even where it rests. Ascending.
[[nodiscard]] std::vector<int> living_classes();

/// The given classes and the living ones: what no dense map holds.
[[nodiscard]] std::vector<int> with_living_classes(std::span<const int> movable);

/// @return for each instance id whether it is of one of the given classes (0 or 1); id 0 is none.
[[nodiscard]] std::array<std::uint8_t, 256> movable_ids(const Segmentation& segmentation,
                                                        std::span<const int> classes);
/// @return image of the segmentation's size: 255 inside instances of the given classes, else 0.
[[nodiscard]] GreyImage movable_mask(const Segmentation& segmentation,
                                     std::span<const int> classes);

}  // namespace ygslam
