#include "scene_picture/viewpoint.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "scene/floor_frame.hpp"

namespace ygslam {
namespace {

// Leaves out what lies far beyond where nearly all points are.
void drop_strays(std::vector<Vec3>& points) {
  constexpr double kStrayShare = 0.002, kFar = 0.2;  // of the points; of the range of the others
  if (points.empty()) return;
  const auto strays = static_cast<std::size_t>(kStrayShare * static_cast<double>(points.size()));
  Vec3 low, high;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [&](const Vec3& p) { return p[axis]; });
    std::sort(values.begin(), values.end());
    low[axis] = values[strays];
    high[axis] = values[values.size() - 1 - strays];
  }
  const Vec3 margin = kFar * (high - low);
  std::erase_if(points, [&](const Vec3& p) {
    return ((p - low + margin).array() < 0).any() || ((high + margin - p).array() < 0).any();
  });
}

// Points that count, thinned out where there are many; in the floor's frame.
std::vector<Vec3> sampled_points(std::span<const SurfacePoint> points, const SE3& T_floor_world,
                                 double cut_above_m) {
  constexpr std::size_t kEnough = 100'000;
  const std::size_t step = points.size() / kEnough + 1;
  std::vector<Vec3> sample;
  for (std::size_t i = 0; i < points.size(); i += step) {
    sample.emplace_back(T_floor_world * points[i].p_world.cast<double>());
    sample.back().z() = std::min(sample.back().z(), cut_above_m);  // the wall below it stays
  }
  drop_strays(sample);
  return sample;
}

// Direction of the scene's longer side, in the floor [rad].
double longer_side(std::span<const Vec3> points) {
  Vec2 mean = Vec2::Zero();
  for (const Vec3& p : points) mean += p.head<2>() / static_cast<double>(points.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Vec3& p : points) spread += (p.head<2>() - mean) * (p.head<2>() - mean).transpose();
  // The same line whichever way it points: to the right in the floor's frame.
  const Vec2 along = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvectors().col(1);
  return along.x() < 0 ? std::atan2(-along.y(), -along.x()) : std::atan2(along.y(), along.x());
}

// The nearest eye from which all points lie in the picture, looking along z: for every point
// |x - eye_x| <= slope_x (z - eye_z), and so for y.
Vec3 nearest_eye(std::span<const Vec3> points, const Vec2& slope) {
  Vec3 eye(0, 0, 1e9);
  for (int axis = 0; axis < 2; ++axis) {
    double right = -1e9, left = -1e9;
    for (const Vec3& p : points) {
      right = std::max(right, p[axis] - slope[axis] * p.z());
      left = std::max(left, -p[axis] - slope[axis] * p.z());
    }
    eye[axis] = (right - left) / 2;
    eye.z() = std::min(eye.z(), -(right + left) / (2 * slope[axis]));
  }
  return eye;
}

}  // namespace

SE3 look_at(const Vec3& eye_world, const Vec3& target_world, const Vec3& up_world) {
  const Vec3 ahead = (target_world - eye_world).normalized();
  Vec3 right = ahead.cross(up_world.normalized());
  if (right.norm() < 1e-6) right = ahead.unitOrthogonal();
  right.normalize();
  Mat3 R_world_camera;
  R_world_camera << right, ahead.cross(right), ahead;
  return SE3(R_world_camera, eye_world).inverse();
}

Viewpoint overview(std::span<const SurfacePoint> points, const Gravity& gravity,
                   const Overview& options) {
  const SE3 T_world = T_world_floor(gravity);
  auto sample = sampled_points(points, T_world.inverse(), options.cut_above_m);
  for (const Vec3& p_world : options.also_world) sample.push_back(T_world.inverse() * p_world);
  // Never quite straight down, so that the way ahead stays up in the picture.
  const double elevation = std::min(options.elevation_rad, 1.5707);
  const double azimuth = options.azimuth_rad + (sample.empty() ? 0 : longer_side(sample));
  const double level = std::cos(elevation);
  const Vec3 eye_way(level * std::sin(azimuth), -level * std::cos(azimuth), std::sin(elevation));

  Viewpoint view;
  view.width = options.width;
  view.height = options.height;
  view.focal_px = 1.1 * std::max(options.width, options.height);
  const SE3 T_camera_floor = look_at(eye_way, Vec3::Zero(), Vec3::UnitZ());
  constexpr double kMargin = 0.94;  // of the picture that the scene fills
  const Vec2 slope = kMargin / 2 / view.focal_px * Vec2(options.width, options.height);
  std::vector<Vec3> turned(sample.size());
  std::transform(sample.begin(), sample.end(), turned.begin(),
                 [&](const Vec3& p) -> Vec3 { return T_camera_floor.R() * p; });
  Vec3 eye = turned.empty() ? Vec3(0, 0, -5) : nearest_eye(turned, slope);
  view.T_camera_world = SE3(T_camera_floor.R(), -eye) * T_world.inverse();
  return view;
}

}  // namespace ygslam
