// New landmarks for a keyframe: from its depth, and by triangulation where depth is missing.
#pragma once

#include <vector>

#include "geometry/camera.hpp"
#include "map/map.hpp"

namespace ygslam {

struct LandmarkMakerConfig {
  double close_depth_m = 8.0;      ///< every static feature nearer than this becomes a landmark
  int min_from_depth = 100;        ///< and at least this many of the nearest, however far
  float min_static_weight = 0.5F;  ///< what is less surely static waits for the keyframe's mask
  int triangulation_neighbours = 5;
  double min_parallax_rad = 0.02;
  double max_epipolar_chi2 = 3.841;
  double max_reprojection_chi2 = 5.991;
  int max_distance = 50;  ///< Hamming, for triangulation
};

/// @param made the new landmarks are appended.
void make_from_depth(Map& map, const Camera& camera, KeyframeId keyframe,
                     const LandmarkMakerConfig& config, std::vector<LandmarkId>& made);

/// Pairs features without depth with those of the most covisible keyframes.
void make_by_triangulation(Map& map, const Camera& camera, KeyframeId keyframe,
                           const LandmarkMakerConfig& config, std::vector<LandmarkId>& made);

}  // namespace ygslam
