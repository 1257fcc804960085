#include "mapping/landmark_maker.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/epipolar.hpp"
#include "geometry/triangulation.hpp"

namespace ygslam {
namespace {

constexpr int kSharedToPair = 15;  // landmarks that keyframes to triangulate from have in common

std::vector<std::uint32_t> without_landmark(const Keyframe& keyframe, bool with_depth,
                                            float min_weight) {
  std::vector<std::uint32_t> free;
  for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const bool has_depth = keyframe.data->features->points[i].depth_m > 0;
    if (keyframe.landmarks[i] == kNoLandmark && has_depth == with_depth &&
        keyframe.static_weight[i] >= min_weight) {
      free.push_back(i);
    }
  }
  return free;
}

bool reprojects(const Camera& camera, const SE3& T_camera_world, const Vec3& p_world,
                const Feature& feature, double octave_scale, double max_chi2) {
  const Vec3 p_camera = T_camera_world * p_world;
  if (p_camera.z() < 0.1) return false;
  const Vec2 error = camera.project(p_camera) - feature.ideal_px.cast<double>();
  return error.squaredNorm() <= max_chi2 * octave_scale * octave_scale;
}

void triangulate_pair(Map& map, const Camera& camera, KeyframeId id, KeyframeId neighbour_id,
                      const LandmarkMakerConfig& config, std::vector<LandmarkId>& made) {
  const Keyframe& a = map.keyframe(id);
  const Keyframe& b = map.keyframe(neighbour_id);
  const Mat3 F = fundamental_from_pose(camera, b.T_camera_world * a.T_camera_world.inverse());
  const Features& fa = *a.data->features;
  const Features& fb = *b.data->features;
  const auto free_a = without_landmark(a, false, config.min_static_weight);
  auto free_b = without_landmark(b, false, config.min_static_weight);
  const double max_epipolar_sigmas = std::sqrt(config.max_epipolar_chi2);
  for (const std::uint32_t i : free_a) {
    const Vec2 a_px = fa.points[i].ideal_px.cast<double>();
    int best = config.max_distance + 1;
    std::uint32_t best_j = 0;
    for (const std::uint32_t j : free_b) {
      const int d = distance(fa.descriptors[i], fb.descriptors[j]);
      if (d >= best) continue;
      const double limit_px = max_epipolar_sigmas * map.scales().of(fb.points[j].octave);
      if (epipolar_distance_px(F, {a_px, fb.points[j].ideal_px.cast<double>()}) > limit_px)
        continue;
      best = d;
      best_j = j;
    }
    if (best > config.max_distance) continue;
    const auto p_world =
        triangulate(camera, a.T_camera_world, a_px, b.T_camera_world,
                    fb.points[best_j].ideal_px.cast<double>(), config.min_parallax_rad);
    if (!p_world) continue;
    const double scale_a = map.scales().of(fa.points[i].octave);
    const double scale_b = map.scales().of(fb.points[best_j].octave);
    if (!reprojects(camera, a.T_camera_world, *p_world, fa.points[i], scale_a,
                    config.max_reprojection_chi2) ||
        !reprojects(camera, b.T_camera_world, *p_world, fb.points[best_j], scale_b,
                    config.max_reprojection_chi2)) {
      continue;
    }
    std::erase(free_b, best_j);
    const LandmarkId landmark = map.add_landmark(*p_world, id, i);
    map.add_observation(landmark, neighbour_id, best_j);
    map.refresh(landmark);
    made.push_back(landmark);
  }
}

}  // namespace

void make_from_depth(Map& map, const Camera& camera, KeyframeId id,
                     const LandmarkMakerConfig& config, std::vector<LandmarkId>& made) {
  const Keyframe& keyframe = map.keyframe(id);
  const auto& points = keyframe.data->features->points;
  auto free = without_landmark(keyframe, true, config.min_static_weight);
  std::stable_sort(free.begin(), free.end(), [&](std::uint32_t a, std::uint32_t b) {
    return points[a].depth_m < points[b].depth_m;
  });
  const SE3 T_world_camera = keyframe.T_camera_world.inverse();
  int count = 0;
  for (const std::uint32_t i : free) {
    if (points[i].depth_m > config.close_depth_m && count >= config.min_from_depth) break;
    const Vec3 p_camera = camera.unproject(points[i].ideal_px.cast<double>(), points[i].depth_m);
    made.push_back(map.add_landmark(T_world_camera * p_camera, id, i));
    ++count;
  }
}

void make_by_triangulation(Map& map, const Camera& camera, KeyframeId keyframe,
                           const LandmarkMakerConfig& config, std::vector<LandmarkId>& made) {
  for (const KeyframeId neighbour : map.covisible(
           keyframe, kSharedToPair, static_cast<std::size_t>(config.triangulation_neighbours))) {
    triangulate_pair(map, camera, keyframe, neighbour, config, made);
  }
}

}  // namespace ygslam
