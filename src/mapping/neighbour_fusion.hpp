// Landmarks that neighbouring keyframes show twice become one.
#pragma once

#include <vector>

#include "geometry/camera.hpp"
#include "map/map.hpp"

namespace ygslam {

struct NeighbourFusionConfig {
  int max_neighbours = 12;
  double search_px = 3;           ///< window in pyramid level 0
  int max_distance = 50;          ///< Hamming
  double max_depth_error = 0.06;  ///< relative difference between measured and predicted depth
};

/// Keyframes that look at the same place: covisible ones and those that these
/// share with, near in space and direction.
[[nodiscard]] std::vector<KeyframeId> neighbours(const Map& map, KeyframeId keyframe,
                                                 std::size_t max_count);

/// Projects the neighbours' landmarks into the keyframe and its own into them; adds observations
/// or fuses landmarks. @return number of changes.
int fuse_with_neighbours(Map& map, const Camera& camera, KeyframeId keyframe,
                         const NeighbourFusionConfig& config);

/// The same with keyframes that are not neighbours yet.
int fuse_with(Map& map, const Camera& camera, KeyframeId keyframe,
              const std::vector<KeyframeId>& others, const NeighbourFusionConfig& config);

}  // namespace ygslam
