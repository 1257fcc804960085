#include "geometry/smooth_path.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace ygslam {
namespace {

constexpr double kReach_s = 0.17;  // hands tremble at 8 Hz and more, but by less than poses err
constexpr double kMostGap_s = 0.1;
constexpr double kMostSpeed_mps = 3;  // more is no motion in a hand
constexpr std::size_t kFewestPoints = 8;
constexpr double kMostShift_m = 0.03;  // farther off it is no error of a pose: no cubic's motion

bool is_interrupted(const PathPoint& a, const PathPoint& b) {
  const double dt_s = b.t_s - a.t_s;
  return dt_s > kMostGap_s || (b.p_world - a.p_world).norm() > kMostSpeed_mps * kMostGap_s;
}

/// @param near holds `centre`.
Vec3 on_cubic(std::span<const PathPoint> near, const PathPoint& centre) {
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 3> b = Eigen::Matrix<double, 4, 3>::Zero();
  for (const PathPoint& point : near) {
    const double x = (point.t_s - centre.t_s) / kReach_s;
    const double u = std::abs(x) / 1.2;
    const double root = 1 - u * u * u;  // tricube (Cleveland 1979)
    const double weight = root * root * root;
    const Eigen::Vector4d basis(1, x, x * x, x * x * x);
    A += weight * basis * basis.transpose();
    b += weight * basis * (point.p_world - centre.p_world).transpose();
  }
  const Eigen::Matrix<double, 4, 3> solved = A.ldlt().solve(b);
  const Vec3 shift = solved.row(0).transpose();
  return shift.norm() <= kMostShift_m ? Vec3(centre.p_world + shift) : centre.p_world;
}

}  // namespace

std::vector<Vec3> smooth_path(std::span<const PathPoint> path) {
  std::vector<Vec3> smooth;
  smooth.reserve(path.size());
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto is_near = [&](std::size_t k) {
      return std::abs(path[k].t_s - path[i].t_s) <= kReach_s;
    };
    std::size_t begin = i, end = i + 1;
    while (begin > 0 && is_near(begin - 1) && !is_interrupted(path[begin - 1], path[begin]))
      --begin;
    while (end < path.size() && is_near(end) && !is_interrupted(path[end - 1], path[end])) ++end;
    const auto near = path.subspan(begin, end - begin);
    smooth.push_back(near.size() < kFewestPoints ? path[i].p_world : on_cubic(near, path[i]));
  }
  return smooth;
}

}  // namespace ygslam
