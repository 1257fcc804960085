#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>

#include "geometry/pnp.hpp"

namespace ygslam {
namespace {

constexpr double kRealRoot = 1e-3;  // largest imaginary part of a double root blurred by rounding
constexpr double kSameSolution = 1e-6;   // relative
constexpr double kDistanceError = 1e-8;  // relative, after polishing

struct Quartic {
  std::array<double, 5> a;  // a[0] + a[1] v + ... + a[4] v^4
};

// Cosines between the rays and squared distances between the points, by the pair left out:
// [0] is of points 1 and 2, [1] of 0 and 2, [2] of 0 and 1.
struct Triangle {
  std::array<double, 3> cosine, squared;
};

// Haralick et al. 1991, eq. (9): v = distance of point 2 over distance of point 0.
Quartic grunert_quartic(const Triangle& t) {
  const auto& [ca, cb, cg] = t.cosine;
  const double a = t.squared[0] / t.squared[1];
  const double c = t.squared[2] / t.squared[1];
  const double d = a - c;
  const double s = 1 - a - c;
  return {{(1 + d) * (1 + d) - 4 * a * cg * cg,
           4 * (-d * (1 + d) * cb + 2 * a * cg * cg * cb - s * ca * cg),
           2 * (d * d - 1 + 2 * d * d * cb * cb + 2 * (1 - c) * ca * ca -
                4 * (a + c) * ca * cb * cg + 2 * (1 - a) * cg * cg),
           4 * (d * (1 - d) * cb - s * ca * cg + 2 * c * ca * ca * cb),
           (d - 1) * (d - 1) - 4 * c * ca * ca}};
}

// Real parts of the (nearly) real roots, by the companion matrix. @return how many.
int real_roots(const Quartic& q, std::array<double, 4>& roots) {
  const double largest = std::abs(*std::max_element(
      q.a.begin(), q.a.end(), [](double x, double y) { return std::abs(x) < std::abs(y); }));
  if (!std::isfinite(largest) || std::abs(q.a[4]) < 1e-12 * largest || largest == 0) return 0;
  Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
  companion.bottomLeftCorner<3, 3>().setIdentity();
  for (int i = 0; i < 4; ++i) companion(i, 3) = -q.a[i] / q.a[4];
  const Eigen::EigenSolver<Eigen::Matrix4d> solver(companion, false);
  if (solver.info() != Eigen::Success) return 0;
  int count = 0;
  for (int i = 0; i < 4; ++i) {
    const std::complex<double> root = solver.eigenvalues()[i];
    if (std::abs(root.imag()) < kRealRoot * (1 + std::abs(root.real())))
      roots[count++] = root.real();
  }
  return count;
}

// Squared distances of the points at these distances along their rays, less the true ones.
Vec3 distance_error(const Triangle& t, const Vec3& s) {
  return {s[1] * s[1] + s[2] * s[2] - 2 * s[1] * s[2] * t.cosine[0] - t.squared[0],
          s[0] * s[0] + s[2] * s[2] - 2 * s[0] * s[2] * t.cosine[1] - t.squared[1],
          s[0] * s[0] + s[1] * s[1] - 2 * s[0] * s[1] * t.cosine[2] - t.squared[2]};
}

// Newton's method on the distances along the rays (Persson and Nordberg 2018, sec. 3.6).
// @return false if it does not get there.
bool polish(const Triangle& t, Vec3& s) {
  const double scale = t.squared[0] + t.squared[1] + t.squared[2];
  Vec3 error = distance_error(t, s);
  for (int i = 0; i < 8 && error.cwiseAbs().maxCoeff() > 1e-14 * scale; ++i) {
    Mat3 J;
    J << 0, s[1] - s[2] * t.cosine[0], s[2] - s[1] * t.cosine[0],  //
        s[0] - s[2] * t.cosine[1], 0, s[2] - s[0] * t.cosine[1],   //
        s[0] - s[1] * t.cosine[2], s[1] - s[0] * t.cosine[2], 0;
    const Vec3 step = (2 * J).inverse() * error;
    if (!step.allFinite()) break;
    const Vec3 next_error = distance_error(t, s - step);
    if (!(next_error.norm() < error.norm())) break;
    s -= step;
    error = next_error;
  }
  return s.minCoeff() > 0 && error.cwiseAbs().maxCoeff() < kDistanceError * scale;
}

// The rigid motion between congruent triangles, from the frames they span.
SE3 motion_between(const std::array<Vec3, 3>& from, const std::array<Vec3, 3>& to) {
  const auto frame = [](const std::array<Vec3, 3>& p) {
    Mat3 F;
    F.col(0) = (p[1] - p[0]).normalized();
    F.col(2) = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
    F.col(1) = F.col(2).cross(F.col(0));
    return F;
  };
  const Mat3 R = frame(to) * frame(from).transpose();
  return SE3(R, to[0] - R * from[0]);
}

}  // namespace

P3pSolutions solve_p3p(const std::array<Vec3, 3>& rays, const std::array<Vec3, 3>& p_world) {
  P3pSolutions solutions;
  Triangle t;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    t.cosine[i] = rays[j].dot(rays[k]);
    t.squared[i] = (p_world[j] - p_world[k]).squaredNorm();
  }
  const double area2 = (p_world[1] - p_world[0]).cross(p_world[2] - p_world[0]).squaredNorm();
  const double longest = std::max({t.squared[0], t.squared[1], t.squared[2]});
  if (!(area2 > 1e-8 * longest * longest)) return solutions;

  std::array<double, 4> roots{};
  const int count = real_roots(grunert_quartic(t), roots);
  std::array<Vec3, 4> kept;
  for (int i = 0; i < count; ++i) {
    const double v = roots[i];
    const double s0_squared = t.squared[1] / (1 + v * v - 2 * v * t.cosine[1]);
    const double d = (t.squared[0] - t.squared[2]) / t.squared[1];
    const double u =
        ((d - 1) * v * v - 2 * d * t.cosine[1] * v + 1 + d) / (2 * (t.cosine[2] - v * t.cosine[0]));
    if (!(v > 0 && u > 0 && s0_squared > 0) || !std::isfinite(u)) continue;
    Vec3 s = std::sqrt(s0_squared) * Vec3(1, u, v);
    if (!polish(t, s)) continue;
    bool is_known = false;
    for (int k = 0; k < solutions.count; ++k) {
      is_known |= (kept[k] - s).norm() < kSameSolution * s.norm();
    }
    if (is_known) continue;
    kept[solutions.count] = s;
    solutions.T_camera_world[solutions.count++] =
        motion_between(p_world, {s[0] * rays[0], s[1] * rays[1], s[2] * rays[2]});
  }
  return solutions;
}

}  // namespace ygslam
