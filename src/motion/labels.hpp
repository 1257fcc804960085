// Labels of points, and which point of the current frame continues which of the previous one.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "features/feature.hpp"

namespace ygslam {

/// Whether a point belongs to the fixed world.
enum class MotionLabel : std::uint8_t { kUnknown, kStatic, kDynamic };

/// What the newest mask says about a point.
enum class SemanticLabel : std::uint8_t {
  kUnknown,
  kStatic,   ///< seen outside every movable mask
  kMovable,  ///< on an instance of a movable class
};

/// Where the flow of a previous point ends in the current image.
struct FlowEnd {
  Eigen::Vector2f uv_px = Eigen::Vector2f::Zero();
  bool found = false;
};

/// Per current feature the previous point whose flow ends nearest to it, -1 if none ends within the
/// radius. Several features may share one: a corner is found on several pyramid levels.
/// @param radius_px largest distance, > 0.
[[nodiscard]] std::vector<std::int32_t> link_to_previous(std::span<const Feature> current,
                                                         std::span<const FlowEnd> ends,
                                                         double radius_px);

}  // namespace ygslam
