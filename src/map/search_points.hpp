// Landmarks as points to look for in a view.
#pragma once

#include <span>
#include <vector>

#include "map/map.hpp"
#include "map/projection_matcher.hpp"

namespace ygslam {

/// Those of the landmarks that a camera at this pose could see: in range and from about the side
/// they were seen from; whether in the image is for the matcher to tell.
/// @param search_px window in pyramid level 0.
/// @return source = index into landmarks; descriptors lie in the map.
[[nodiscard]] std::vector<SearchPoint> visible_points(const Map& map, const SE3& T_camera_world,
                                                      std::span<const LandmarkId> landmarks,
                                                      double search_px);

}  // namespace ygslam
