#include "optim/direction.hpp"

namespace ygslam {

Vec3 direction_residual(const MeasuredDirection& direction, const SE3& T_camera_world) {
  return T_camera_world.R() * direction.direction_world - direction.direction_camera;
}

Mat3 direction_jacobian(const MeasuredDirection& direction, const SE3& T_camera_world) {
  return -skew(T_camera_world.R() * direction.direction_world);
}

double direction_cost(std::span<const MeasuredDirection> directions,
                      std::span<const SE3> T_camera_world) {
  double cost = 0;
  for (const MeasuredDirection& direction : directions) {
    const Vec3 e = direction_residual(direction, T_camera_world[direction.pose]);
    cost += 0.5 * e.dot(direction.information * e);
  }
  return cost;
}

void add_direction(const MeasuredDirection& direction, const SE3& T_camera_world,
                   Eigen::Ref<Mat6, 0, Eigen::OuterStride<>> H, Eigen::Ref<Vec6> g) {
  const Mat3 J = direction_jacobian(direction, T_camera_world);
  const Mat3 WJ = direction.information * J;
  H.bottomRightCorner<3, 3>().noalias() += J.transpose() * WJ;
  g.tail<3>().noalias() += WJ.transpose() * direction_residual(direction, T_camera_world);
}

}  // namespace ygslam
