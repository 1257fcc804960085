// What one keyframe shows of things that stand about: a chair, a screen, a bottle.
#pragma once

#include <vector>

#include "scene/scene.hpp"
#include "volume/depth_view.hpp"

namespace ygslam {

/// What a network says of it.
struct Detection {
  SemanticClass semantic_class = SemanticClass::kUnknown;
  float score = 0;  ///< 0 to 1
};

/// The part of its surface that was seen.
struct ThingView {
  Detection detection;
  std::vector<Eigen::Vector3f> p_camera;  ///< one for each small cube of its surface
};

inline constexpr int kMaxDetections = 254;  ///< of one keyframe that a DepthView can number

/// Without the pixels within radius_px (square) of another value; the image's border is no edge.
[[nodiscard]] GreyImage eroded(const GreyImage& ids, int radius_px);

/// The same for masks of things, but that small ones, which are mostly edge, stay whole.
[[nodiscard]] GreyImage without_edges(const GreyImage& ids, int radius_px);

/// One for each detection. Those of which too little is seen to say where they are have no points,
/// and their pixels in the view become DepthView::kNothing.
/// @param view objects are numbers of detections, from 1. @param max_depth_m of points.
[[nodiscard]] std::vector<ThingView> thing_views(DepthView& view,
                                                 const std::vector<Detection>& detections,
                                                 double max_depth_m);

}  // namespace ygslam
