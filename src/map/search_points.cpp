#include "map/search_points.hpp"

#include <algorithm>

namespace ygslam {

std::vector<SearchPoint> visible_points(const Map& map, const SE3& T_camera_world,
                                        std::span<const LandmarkId> landmarks, double search_px) {
  const Vec3 centre_world = T_camera_world.inverse().t();
  std::vector<SearchPoint> points;
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    const Landmark& landmark = map.landmark(landmarks[i]);
    const Vec3 ray = landmark.p_world - centre_world;
    const double range_m = ray.norm();
    if (range_m < 0.8 * landmark.min_distance_m || range_m > 1.2 * landmark.max_distance_m)
      continue;
    if (ray.dot(landmark.normal_world) < 0.5 * range_m) continue;
    const int octave = map.scales().octave_at(landmark.max_distance_m / range_m);
    points.push_back({landmark.p_world, &landmark.descriptor, std::max(0, octave - 1),
                      std::min(map.scales().levels() - 1, octave + 1),
                      search_px * map.scales().of(octave), -1.0F, i});
  }
  return points;
}

}  // namespace ygslam
