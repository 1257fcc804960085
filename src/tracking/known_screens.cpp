#include "tracking/known_screens.hpp"

#include <algorithm>

#include "core/check.hpp"
#include "image/depth.hpp"

namespace ygslam {
namespace {

constexpr double kPlaysFor_s = 20;      // after it was last seen to move
constexpr double kMargin_m = 0.03;      // about the points that moved
constexpr double kOffScreen_m = 0.03;   // in front of it or behind it, and ...
constexpr double kOffScreenSigmas = 3;  // ... so many of its depth
constexpr double kGrowsBy_m = 0.15;     // what moves so far beside it is still on it
constexpr int kFewestRenewing = 4;      // points

double reach_off_m(double depth_m) {
  return kOffScreen_m + kOffScreenSigmas * kinect_depth_sigma_m(depth_m);
}

/// Axes in the plane: the camera's x axis, as far as it lies in it, and the one across.
SE3 screen_frame(const Vec3& plane, const Vec3& origin_camera) {
  const Vec3 z = plane.normalized();
  const Vec3 along = std::abs(z.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 x = (along - along.dot(z) * z).normalized();
  Mat3 R_screen_camera;
  R_screen_camera << x.transpose(), z.cross(x).transpose(), z.transpose();
  return SE3(R_screen_camera, -(R_screen_camera * origin_camera));
}

Eigen::AlignedBox2d grown(const Eigen::AlignedBox2d& area, double by_m) {
  return {area.min() - Vec2::Constant(by_m), area.max() + Vec2::Constant(by_m)};
}

}  // namespace

void KnownScreens::add(const Sighting& seen, const SE3& T_odom_camera, Timestamp now) {
  CHECK(!seen.p_camera.empty());
  Screen screen;
  screen.T_screen_odom = screen_frame(seen.plane, seen.p_camera.front()) * T_odom_camera.inverse();
  screen.last_moved = now;
  for (const Vec3& p : seen.p_camera)
    screen.area.extend((screen.T_screen_odom * (T_odom_camera * p)).head<2>().eval());
  screens_.push_back(screen);
}

void KnownScreens::renew(std::span<const Vec3> p_moving, const SE3& T_odom_camera, Timestamp now) {
  for (Screen& screen : screens_) {
    const Eigen::AlignedBox2d near = grown(screen.area, kGrowsBy_m);
    Eigen::AlignedBox2d moved;
    int count = 0;
    for (const Vec3& p_camera : p_moving) {
      const Vec3 p = screen.T_screen_odom * (T_odom_camera * p_camera);
      if (std::abs(p.z()) > reach_off_m(p_camera.z()) || !near.contains(p.head<2>())) continue;
      moved.extend(p.head<2>().eval());
      ++count;
    }
    if (count < kFewestRenewing) continue;
    screen.area.extend(moved);
    screen.last_moved = now;
  }
}

void KnownScreens::forget_still(Timestamp now) {
  std::erase_if(screens_, [&](const Screen& screen) {
    return seconds_between(now, screen.last_moved) > kPlaysFor_s;
  });
}

bool KnownScreens::shows(const Vec3& p_odom, double depth_m) const {
  return std::any_of(screens_.begin(), screens_.end(), [&](const Screen& screen) {
    const Vec3 p = screen.T_screen_odom * p_odom;
    return std::abs(p.z()) < reach_off_m(depth_m) &&
           grown(screen.area, kMargin_m).contains(p.head<2>());
  });
}

}  // namespace ygslam
