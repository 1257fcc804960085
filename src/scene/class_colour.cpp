#include "scene/class_colour.hpp"

#include <array>
#include <cmath>

#include "scene/coco.hpp"

namespace ygslam {
namespace {

std::vector<SemanticClass> make_classes() {
  std::vector<SemanticClass> classes;
  for (int id = 0; id < std::ssize(coco_class_names()); ++id) classes.push_back(coco_class(id));
  for (const SemanticClass other : {SemanticClass::kFloor, SemanticClass::kWall,
                                    SemanticClass::kCeiling, SemanticClass::kUnknown}) {
    classes.push_back(other);
  }
  return classes;
}

// f(n) = v - v s max(0, min(k, 4 - k, 1)), k = (n + 6 hue) mod 6; n is 5, 3, 1 for red, green,
// blue.
Rgb8 from_hsv(double hue, double saturation, double value) {
  const auto channel = [&](double offset) {
    const double k = std::fmod(offset + hue * 6, 6);
    const double share = std::clamp(std::min(k, 4 - k), 0.0, 1.0);
    return static_cast<std::uint8_t>(std::lround(255 * value * (1 - saturation * share)));
  };
  return {channel(5), channel(3), channel(1)};
}

// Neighbours in number lie a golden angle of hue apart; saturation and value tell the rounds apart.
Rgb8 colour_of_number(int number) {
  constexpr double kGoldenRatio = 0.6180339887498949;
  return from_hsv(std::fmod(number * kGoldenRatio, 1), 0.85 - 0.2 * (number % 3),
                  0.95 - 0.15 * (number / 3 % 3));
}

}  // namespace

std::span<const SemanticClass> all_semantic_classes() {
  static const std::vector<SemanticClass> kClasses = make_classes();
  return kClasses;
}

Rgb8 class_colour(SemanticClass semantic_class) {
  switch (semantic_class) {
    case SemanticClass::kFloor:
      return {152, 140, 124};
    case SemanticClass::kWall:
      return {188, 196, 204};
    case SemanticClass::kCeiling:
      return {226, 224, 214};
    case SemanticClass::kUnknown:
      return {104, 104, 104};
    default:
      break;
  }
  return colour_of_number(static_cast<int>(semantic_class));
}

Rgb8 object_colour(SceneObjectId object) {
  constexpr Rgb8 kGrey{190, 190, 190};
  return object == kNoSceneObject ? kGrey : colour_of_number(static_cast<int>(object));
}

}  // namespace ygslam
