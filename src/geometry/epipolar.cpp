#include "geometry/epipolar.hpp"

#include <cmath>
#include <limits>

namespace ygslam {

double epipolar_distance_px(const Mat3& F, const PointPair& pair) {
  const Vec3 line = F * pair.p1_px.homogeneous();
  const double length = line.head<2>().norm();
  const double distance = std::abs(line.dot(pair.p2_px.homogeneous())) / length;
  return length > 0 && std::isfinite(distance) ? distance : std::numeric_limits<double>::infinity();
}

Mat3 fundamental_from_pose(const Camera& camera, const SE3& T_2_1) {
  Mat3 K_inverse;
  K_inverse << 1 / camera.fx(), 0, -camera.cx() / camera.fx(),  //
      0, 1 / camera.fy(), -camera.cy() / camera.fy(),           //
      0, 0, 1;
  // E = [t]x R, F = K^-T E K^-1 (Hartley & Zisserman 2nd ed., eqs. 9.11, 9.12).
  Mat3 F = K_inverse.transpose() * skew(T_2_1.t()) * T_2_1.R() * K_inverse;
  const double norm = F.norm();
  return norm > 0 ? Mat3(F / norm) : Mat3(Mat3::Zero());
}

}  // namespace ygslam
