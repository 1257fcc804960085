// Known 3D points searched in a frame near where a predicted pose puts them (Mur-Artal, Montiel,
// Tardos 2015, sec. V).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "features/feature.hpp"
#include "features/feature_grid.hpp"
#include "geometry/camera.hpp"

namespace ygslam {

/// A point to look for.
struct SearchPoint {
  Vec3 p_world = Vec3::Zero();
  const Descriptor* descriptor = nullptr;
  int min_octave = 0;  ///< pyramid levels in which it may appear
  int max_octave = 0;
  double radius_px = 0;      ///< search window
  float angle_rad = -1;      ///< orientation where it was seen last; negative = unknown
  std::uint32_t source = 0;  ///< the caller's own index
};

struct PointMatch {
  std::uint32_t source = 0;
  std::uint32_t feature = 0;
  int distance = 0;  ///< Hamming
};

struct ProjectionMatcherConfig {
  int max_distance = 100;          ///< Hamming
  double ratio = 0.8;              ///< best to second best in the same octave
  bool check_orientation = false;  ///< keep only the dominant rotations
};

/// @param usable per feature; 0 = must not be matched (dynamic or taken).
/// @return at most one match per feature and per point, in order of `points`.
[[nodiscard]] std::vector<PointMatch> match_by_projection(
    const Camera& camera, const SE3& T_camera_world, std::span<const SearchPoint> points,
    const Features& features, const FeatureGrid& grid, std::span<const std::uint8_t> usable,
    const ProjectionMatcherConfig& config);

/// Removes matches whose rotation (feature minus point) is not among the three most frequent of 30
/// bins.
void keep_dominant_rotations(std::vector<PointMatch>& matches, std::span<const SearchPoint> points,
                             const Features& features);

}  // namespace ygslam
