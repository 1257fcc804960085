#include "scene/floor_frame.hpp"

#include <cmath>

namespace ygslam {

SE3 T_world_floor(const Gravity& gravity) {
  const Vec3 up = gravity.up_world.normalized();
  CHECK(up.allFinite() && std::isfinite(gravity.floor_m), "which way is up?");
  const Vec3 ahead = std::abs(up.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 x = (ahead - ahead.dot(up) * up).normalized();
  Mat3 R;
  R << x, up.cross(x), up;
  return {R, gravity.floor_m * up};
}

double box_yaw(const OrientedBox& box, const Gravity& gravity) {
  const Vec3 x = T_world_floor(gravity).R().transpose() * box.T_world_box.R().col(0);
  return std::atan2(x.y(), x.x());
}

}  // namespace ygslam
