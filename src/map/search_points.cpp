#include "map/search_points.hpp"

namespace ygslam {

std::vector<SearchPoint> visible_points(const Map& map, const SE3& T_camera_world,
                                        std::span<const LandmarkId> landmarks, double search_px) {
  const Vec3 centre_world = T_camera_world.inverse().t();
  std::vector<SearchPoint> points;
  for (std::uint32_t i = 0; i < landmarks.size(); ++i)
    if (const auto point =
            search_point(map.landmark(landmarks[i]), centre_world, map.scales(), search_px, 1.0, i))
      points.push_back(*point);
  return points;
}

}  // namespace ygslam
