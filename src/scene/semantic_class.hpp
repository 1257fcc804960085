// What a surface of the room is.
#pragma once

#include <cstdint>
#include <string>

namespace ygslam {

/// 0 to 79: a COCO class as the segmentation network numbers them; then what rooms are built of.
enum class SemanticClass : std::uint8_t { kFloor = 80, kWall = 81, kCeiling = 82, kUnknown = 255 };

[[nodiscard]] constexpr SemanticClass coco_class(int class_id) {
  return static_cast<SemanticClass>(class_id);
}

/// 0 is no object; everything else a SceneObject's number.
enum class SceneObjectId : std::uint16_t {};
inline constexpr SceneObjectId kNoSceneObject{0};

/// COCO's name, "floor", "wall", "ceiling" or "unknown".
[[nodiscard]] std::string semantic_class_name(SemanticClass semantic_class);

}  // namespace ygslam
