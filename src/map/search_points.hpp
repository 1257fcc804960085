// Landmarks as points to look for in a view.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "map/map.hpp"
#include "map/projection_matcher.hpp"

namespace ygslam {

/// A landmark (Landmark, ViewLandmark) as a point to look for, with its descriptor; nullopt where
/// it is out of its range, or seen from more than 60 degrees aside of where it was seen from.
/// @param search_px window in pyramid level 0. @param aside factor on it unless seen head-on.
template <typename AnyLandmark>
[[nodiscard]] std::optional<SearchPoint> search_point(const AnyLandmark& landmark,
                                                      const Vec3& centre_world,
                                                      const PyramidScales& scales, double search_px,
                                                      double aside, std::uint32_t source) {
  constexpr double kMinCosine = 0.5;
  constexpr double kHeadOnCosine = 0.998;
  const Vec3 ray = landmark.p_world - centre_world;
  const double range_m = ray.norm();
  if (range_m < 0.8 * landmark.min_distance_m || range_m > 1.2 * landmark.max_distance_m)
    return std::nullopt;
  const double cosine = ray.dot(landmark.normal_world) / range_m;
  if (cosine < kMinCosine) return std::nullopt;
  const int octave = scales.octave_at(landmark.max_distance_m / range_m);
  const double radius_px = search_px * (cosine > kHeadOnCosine ? 1.0 : aside) * scales.of(octave);
  return SearchPoint{landmark.p_world,
                     &landmark.descriptor,
                     std::max(0, octave - 1),
                     std::min(scales.levels() - 1, octave + 1),
                     radius_px,
                     -1.0F,
                     source};
}

/// Those of the landmarks that a camera at this pose could see: in range and from about the side
/// they were seen from; whether in the image is for the matcher to tell.
/// @param search_px window in pyramid level 0.
/// @return source = index into landmarks; descriptors lie in the map.
[[nodiscard]] std::vector<SearchPoint> visible_points(const Map& map, const SE3& T_camera_world,
                                                      std::span<const LandmarkId> landmarks,
                                                      double search_px);

}  // namespace ygslam
