#include "geometry/epipolar.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.hpp"
#include "geometry/two_view_linear.hpp"

namespace ygslam {

using namespace two_view;

double epipolar_distance_px(const Mat3& F, const PointPair& pair) {
  const Vec3 line = F * pair.p1_px.homogeneous();
  const double length = line.head<2>().norm();
  const double distance = std::abs(line.dot(pair.p2_px.homogeneous())) / length;
  return length > 0 && std::isfinite(distance) ? distance : std::numeric_limits<double>::infinity();
}

double sampson_error_px2(const Mat3& F, const PointPair& pair) {
  const Vec3 line2 = F * pair.p1_px.homogeneous();
  const Vec3 line1 = F.transpose() * pair.p2_px.homogeneous();
  const double r = line2.dot(pair.p2_px.homogeneous());
  return r * r / (line2.head<2>().squaredNorm() + line1.head<2>().squaredNorm());
}

std::optional<Mat3> fundamental_eight_point(std::span<const PointPair> pairs,
                                            std::span<const double> weights) {
  CHECK(weights.empty() || weights.size() == pairs.size());
  if (pairs.size() < 8) return std::nullopt;
  const auto n = make_normalisers(pairs, weights);
  if (!n) return std::nullopt;
  Mat6 moments = Mat6::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vec2 p1 = n->first(pairs[i].p1_px);
    const Vec2 p2 = n->second(pairs[i].p2_px);
    const Vec6 weighted = (weights.empty() ? 1.0 : weights[i]) * products(p2.x(), p2.y());
    moments.noalias() += weighted * products(p1.x(), p1.y()).transpose();
  }
  const auto solution = least_vector(fundamental_normal_matrix(moments));
  if (!solution) return std::nullopt;
  const Mat3 F =
      n->second.matrix().transpose() * nearest_rank_two_exact(*solution) * n->first.matrix();
  const double norm = F.norm();
  if (!(norm > 0) || !std::isfinite(norm)) return std::nullopt;
  return Mat3(F / norm);
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
