#include "mapping/landmark_maker.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

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

// x_b^T E x_a = 0 for normalised image points.
Mat3 essential(const SE3& T_b_a) { return skew(T_b_a.t()) * T_b_a.R(); }

Vec3 ray(const Camera& camera, const Feature& feature) {
  return camera.unproject(feature.ideal_px.cast<double>(), 1.0);
}

// Squared distance to the epipolar line in image b [normalised units].
double epipolar_distance2(const Mat3& E, const Vec3& x_a, const Vec3& x_b) {
  const Vec3 line = E * x_a;
  const double error = x_b.dot(line);
  return error * error / std::max(1e-18, line.head<2>().squaredNorm());
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
  const Mat3 E = essential(b.T_camera_world * a.T_camera_world.inverse());
  const Features& fa = *a.data->features;
  const Features& fb = *b.data->features;
  const auto free_a = without_landmark(a, false, config.min_static_weight);
  auto free_b = without_landmark(b, false, config.min_static_weight);
  std::vector<std::uint8_t> taken(fb.size(), 0);
  for (const std::uint32_t i : free_a) {
    const Vec3 x_a = ray(camera, fa.points[i]);
    int best = config.max_distance + 1;
    std::uint32_t best_j = 0;
    for (const std::uint32_t j : free_b) {
      if (taken[j]) continue;
      const int d = distance(fa.descriptors[i], fb.descriptors[j]);
      if (d >= best) continue;
      const double sigma = map.octave_scale(fb.points[j].octave) / camera.fx();
      if (epipolar_distance2(E, x_a, ray(camera, fb.points[j])) >
          config.max_epipolar_chi2 * sigma * sigma) {
        continue;
      }
      best = d;
      best_j = j;
    }
    if (best > config.max_distance) continue;
    const auto p_world = triangulate(camera, a.T_camera_world, fa.points[i].ideal_px.cast<double>(),
                                     b.T_camera_world, fb.points[best_j].ideal_px.cast<double>(),
                                     config.min_parallax_rad);
    if (!p_world) continue;
    const double scale_a = map.octave_scale(fa.points[i].octave);
    const double scale_b = map.octave_scale(fb.points[best_j].octave);
    if (!reprojects(camera, a.T_camera_world, *p_world, fa.points[i], scale_a,
                    config.max_reprojection_chi2) ||
        !reprojects(camera, b.T_camera_world, *p_world, fb.points[best_j], scale_b,
                    config.max_reprojection_chi2)) {
      continue;
    }
    taken[best_j] = 1;
    const LandmarkId landmark = map.add_landmark(*p_world, id, i);
    map.add_observation(landmark, neighbour_id, best_j);
    map.refresh(landmark);
    made.push_back(landmark);
  }
}

}  // namespace

int make_from_depth(Map& map, const Camera& camera, KeyframeId id,
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
  return count;
}

int make_by_triangulation(Map& map, const Camera& camera, KeyframeId keyframe,
                          const LandmarkMakerConfig& config, std::vector<LandmarkId>& made) {
  const std::size_t before = made.size();
  for (const KeyframeId neighbour :
       map.covisible(keyframe, 15, static_cast<std::size_t>(config.triangulation_neighbours))) {
    triangulate_pair(map, camera, keyframe, neighbour, config, made);
  }
  return static_cast<int>(made.size() - before);
}

std::optional<Vec3> triangulate(const Camera& camera, const SE3& T_a_world, const Vec2& a_px,
                                const SE3& T_b_world, const Vec2& b_px, double min_parallax_rad) {
  const SE3 T_world_a = T_a_world.inverse();
  const SE3 T_world_b = T_b_world.inverse();
  const Vec3 d_a = (T_world_a.R() * camera.unproject(a_px, 1.0)).normalized();
  const Vec3 d_b = (T_world_b.R() * camera.unproject(b_px, 1.0)).normalized();
  const double cosine = d_a.dot(d_b);
  if (cosine > std::cos(min_parallax_rad)) return std::nullopt;
  // Normal equations of |a + s d_a - b - t d_b|^2.
  const Vec3 baseline = T_world_b.t() - T_world_a.t();
  const double denominator = 1.0 - cosine * cosine;
  const double s = (baseline.dot(d_a) - cosine * baseline.dot(d_b)) / denominator;
  const double t = (cosine * baseline.dot(d_a) - baseline.dot(d_b)) / denominator;
  if (s < 0.1 || t < 0.1) return std::nullopt;
  return 0.5 * (T_world_a.t() + s * d_a + T_world_b.t() + t * d_b);
}

}  // namespace ygslam
