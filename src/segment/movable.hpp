// What can move, by its class: of this no map is made, and no camera is placed by it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "segment/segmenter.hpp"

namespace ygslam {

/// Persons and animals, which are no part of a room even where they rest, and the classes that
/// settings name beside them. Tracking, mapping, the dense map and the background all go by it.
class MovableClasses {
 public:
  /// Persons and animals alone; persons are the class that settings name by default.
  MovableClasses() : MovableClasses(std::vector<int>{0}) {}
  /// @param named COCO numbers.
  explicit MovableClasses(std::vector<int> named);
  /// @param names COCO class names ("person", "dog") and groups: "animals", "vehicles", "handheld"
  /// (what people carry, lift or play with), "furniture" (what people move now and then).
  /// @return kConfig: an unknown name, with the nearest that is known.
  [[nodiscard]] static Result<MovableClasses> of_names(std::span<const std::string> names);

  [[nodiscard]] bool contains(int class_id) const;
  /// Those that settings name, ascending, each once: what a network is to look for first.
  [[nodiscard]] const std::vector<int>& named() const { return named_; }

  friend bool operator==(const MovableClasses&, const MovableClasses&) = default;

 private:
  std::vector<int> named_;
};

/// @return for each instance id whether it can move (0 or 1); id 0 is none.
[[nodiscard]] std::array<std::uint8_t, 256> movable_ids(const Segmentation& segmentation,
                                                        const MovableClasses& classes);
/// @return image of the segmentation's size: 255 inside instances that can move, else 0.
[[nodiscard]] GreyImage movable_mask(const Segmentation& segmentation,
                                     const MovableClasses& classes);

}  // namespace ygslam
