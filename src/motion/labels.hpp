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

struct FlowLinks {
  /// Per current feature: the flow end nearest to it within the radius (index of the previous
  /// point), -1 if none. Several features may share one.
  std::vector<std::int32_t> nearest;
  /// The same with each previous point given away once, nearest pairs first.
  std::vector<std::int32_t> unique;
};

/// Links each current feature to the end of a previous point's flow.
/// @param radius_px largest distance, > 0.
[[nodiscard]] FlowLinks link_flow(std::span<const Feature> current, std::span<const FlowEnd> ends,
                                  double radius_px);

/// Only the unique links: index of the previous point per current feature, or -1.
[[nodiscard]] std::vector<std::int32_t> link_to_previous(std::span<const Feature> current,
                                                         std::span<const FlowEnd> ends,
                                                         double radius_px);

}  // namespace ygslam
