#include "scene/semantic_class.hpp"

#include "scene/coco.hpp"

namespace ygslam {

std::string semantic_class_name(SemanticClass semantic_class) {
  switch (semantic_class) {
    case SemanticClass::kFloor:
      return "floor";
    case SemanticClass::kWall:
      return "wall";
    case SemanticClass::kCeiling:
      return "ceiling";
    default:
      return coco_class_name(static_cast<int>(semantic_class));
  }
}

}  // namespace ygslam
