#include "facade/convert.hpp"

#include <algorithm>
#include <cmath>

#include "facade/settings.hpp"
#include "system/pose_covariance.hpp"

namespace ygslam::api {
namespace {

std::array<double, 36> row_major(const Mat6& covariance) {
  std::array<double, 36> result{};
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(result.data()) = covariance;
  return result;
}

Object to_api(const TrackedObject& o) {
  return {index(o.id),
          coco_class_name(o.class_id),
          o.age_frames,
          o.missing_frames,
          o.resting,
          o.faded,
          api::to_api(o.centre_world),
          api::to_api(o.velocity_world_mps),
          api::to_api(o.min_world),
          api::to_api(o.max_world),
          api::to_api(o.body_world.position_m),
          api::to_api(o.body_world.velocity_mps),
          row_major(o.body_world.covariance)};
}

State to_api(TrackState state) {
  switch (state) {
    case TrackState::kWaiting:
      return State::kWaiting;
    case TrackState::kTracking:
      return State::kTracking;
    case TrackState::kWeak:
      return State::kWeak;
    case TrackState::kLost:
      return State::kLost;
    case TrackState::kCoasting:
      return State::kCoasting;
  }
  return State::kLost;
}

}  // namespace

Pose to_api(const SE3& T) {
  const Eigen::Quaterniond q = T.quaternion();
  return {{T.t().x(), T.t().y(), T.t().z()}, {q.x(), q.y(), q.z(), q.w()}};
}

std::vector<MapPoint> to_api(std::span<const ColouredPoint> points) {
  std::vector<MapPoint> result;
  result.reserve(points.size());
  for (const ColouredPoint& p : points)
    result.push_back(
        {p.p_world.x(), p.p_world.y(), p.p_world.z(), p.colour.r, p.colour.g, p.colour.b});
  return result;
}

Result to_api(const TrackResult& tracked) {
  Result result;
  result.state = to_api(tracked.state);
  result.T_world_camera = to_api(tracked.T_world_camera);
  result.T_odom_camera = to_api(tracked.T_odom_camera);
  result.T_world_odom = to_api(tracked.T_world_odom);
  result.covariance = row_major(odom_covariance(tracked));
  result.map_covariance = row_major(map_covariance(tracked));
  result.seen_covariance = row_major(seen_covariance(tracked));
  result.provisional = tracked.provisional;
  result.static_points = tracked.labels.static_points;
  result.dynamic_points = tracked.labels.dynamic_points;
  result.unknown_points = tracked.labels.unknown_points;
  result.inliers = tracked.inliers;
  result.mask_age_frames = tracked.mask_age_frames;
  for (const TrackedObject& object : tracked.objects) result.objects.push_back(to_api(object));
  return result;
}

Forecast Object::after(double seconds) const {
  if (!(seconds >= 0) || !std::isfinite(seconds))
    fail({ErrorKind::kUsage, "Object::after: a time from now on is expected, in seconds"});
  const auto vector = [](const std::array<double, 3>& v) { return Vec3(v[0], v[1], v[2]); };
  const ObjectMotion now{
      vector(body_world_m), vector(body_velocity_world_mps),
      Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(body_covariance.data())};
  const ObjectMotion then = now.after(seconds);
  Forecast forecast{api::to_api(then.position_m), {}};
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(forecast.covariance_m2.data()) =
      then.covariance.topLeftCorner<3, 3>();
  return forecast;
}

bool is_finite(const std::array<double, 3>& v) {
  return std::ranges::all_of(v, [](double x) { return std::isfinite(x); });
}

bool is_pose(const Pose& pose) {
  const auto& [x, y, z, w] = pose.rotation_xyzw;
  constexpr double kNotOne = 1e-3;
  return is_finite(pose.translation_m) &&
         std::abs(std::hypot(std::hypot(x, y), std::hypot(z, w)) - 1) < kNotOne;
}

bool is_within(const Pose& pose, double most_m) {
  return std::ranges::all_of(pose.translation_m, [&](double v) { return std::abs(v) <= most_m; });
}

SE3 to_se3(const Pose& pose, const char* name) {
  const auto& [x, y, z, w] = pose.rotation_xyzw;
  if (!is_pose(pose))
    fail({ErrorKind::kInput,
          std::string(name) + ": finite numbers and a unit quaternion are expected"});
  const auto& t = pose.translation_m;
  return {Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix(), Vec3(t[0], t[1], t[2])};
}

}  // namespace ygslam::api
