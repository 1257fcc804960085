// What one keyframe shows of objects that stand about: a chair, a screen, a bottle.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/scene.hpp"
#include "volume/depth_view.hpp"

namespace ygslam {

/// What a network says of it.
struct Detection {
  SemanticClass semantic_class = SemanticClass::kUnknown;
  float score = 0;  ///< 0 to 1
};

/// Pixels by colour: red / 64 | green / 64 << 2 | blue / 64 << 4.
using ColourCounts = std::array<std::uint32_t, 64>;

/// The part of its surface that was seen.
struct ObjectObservation {
  Detection detection;
  std::vector<Eigen::Vector3f> p_camera;  ///< one for each small cube of its surface
  ColourCounts colours{};
  bool is_moving = false;
};

inline constexpr int kMaxDetections =
    DepthView::kUnsure - 1;  ///< of one keyframe that a DepthView can number

/// The mask grown: each pixel gets the greatest value within radius_px (a square).
/// @return empty for an empty mask.
[[nodiscard]] GreyImage dilated(const GreyImage& mask, int radius_px);

/// Without the pixels within radius_px (square) of another value; the image's border is no edge.
[[nodiscard]] GreyImage eroded(const GreyImage& ids, int radius_px);

/// The same for masks of objects, but that small ones, which are mostly edge, stay whole.
[[nodiscard]] GreyImage without_edges(const GreyImage& ids, int radius_px);

/// Points on an object that were seen to move, and to stand still.
struct MotionVotes {
  int moving = 0, standing = 0;
  auto operator<=>(const MotionVotes&) const = default;
};

/// Which of the detections move: of their pixels so many are marked in `movers` (empty: none), and
/// of the points on them, if there are any, more move than stand.
/// @param votes by detection; empty: no points are known.
[[nodiscard]] std::vector<bool> moving_detections(const GreyImage& things, const GreyImage& movers,
                                                  std::size_t detections,
                                                  std::span<const MotionVotes> votes);

/// Excludes the pixels of some numbers of the view's objects, and what lies around them.
/// @param is_removed by number - 1.
void exclude_objects(DepthView& view, const std::vector<bool>& is_removed, int radius_px);

/// One for each detection. Those of which too little is seen to say where they are have no points,
/// and their pixels in the view become DepthView::kUnsure.
/// @param view objects are numbers of detections, from 1. @param max_depth_m of points.
[[nodiscard]] std::vector<ObjectObservation> observe_objects(
    DepthView& view, const std::vector<Detection>& detections, double max_depth_m);

}  // namespace ygslam
