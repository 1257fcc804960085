#include "tracking/odometry.hpp"

namespace ygslam {
namespace {

constexpr double kProvingWay_m = 8;

}  // namespace

Odometry::Place Odometry::place(const SE3& T_world_camera, bool sees_known_ground) {
  Place place{T_world_camera * T_odom_camera_.inverse()};
  if (T_world_odom_)
    place.correction_m = (T_world_camera.t() - (*T_world_odom_ * T_odom_camera_).t()).norm();
  T_world_odom_ = place.T_world_odom;
  if (doubtful_since_ && sees_known_ground &&
      (T_odom_camera_.t() - *doubtful_since_).norm() > kProvingWay_m)
    doubtful_since_.reset();
  place.provisional = is_doubtful();
  return place;
}

}  // namespace ygslam
