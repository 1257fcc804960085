#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "geometry/pnp.hpp"

namespace ygslam {
namespace {

constexpr double kRealRoot = 1e-3;  // largest imaginary part of a double root blurred by rounding
constexpr int kMostRounds = 60;     // a double root gains a bit in each
constexpr double kSettled = 1e-10;  // last step over the size of the roots; the next is far below
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

// Real parts of the (nearly) real roots, in order; all four roots are found at once (Aberth 1973).
// @return how many.
int real_roots(const Quartic& q, std::array<double, 4>& roots) {
  const double largest = std::abs(*std::max_element(
      q.a.begin(), q.a.end(), [](double x, double y) { return std::abs(x) < std::abs(y); }));
  if (!std::isfinite(largest) || std::abs(q.a[4]) < 1e-12 * largest || largest == 0) return 0;
  std::array<double, 4> b;  // v^4 + b[3] v^3 + ... + b[0]
  double radius = 0;        // half of Fujiwara's bound of the roots
  for (std::size_t i = 0; i < 4; ++i) {
    b[i] = q.a[i] / q.a[4];
    radius = std::max(radius, std::pow(std::abs(b[i]), 1.0 / static_cast<double>(4 - i)));
  }
  using Complex = std::complex<double>;
  std::array<Complex, 4> v;
  for (std::size_t k = 0; k < 4; ++k)  // on no line of symmetry of a real polynomial
    v[k] = -b[3] / 4 + std::polar(radius, std::numbers::pi / 2 * static_cast<double>(k) + 0.4);
  double moved = radius;
  for (int round = 0; round < kMostRounds && moved > kSettled * radius; ++round) {
    moved = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const Complex value = (((v[k] + b[3]) * v[k] + b[2]) * v[k] + b[1]) * v[k] + b[0];
      const Complex slope = ((4.0 * v[k] + 3 * b[3]) * v[k] + 2 * b[2]) * v[k] + b[1];
      Complex pull = 0;  // of the other roots
      for (std::size_t j = 0; j < 4; ++j)
        if (v[j] != v[k]) pull += 1.0 / (v[k] - v[j]);
      const Complex divisor = slope - value * pull;
      if (divisor == 0.0) continue;
      const Complex step = value / divisor;
      v[k] -= step;
      moved = std::max(moved, std::abs(step));
    }
  }
  int count = 0;
  for (const Complex& root : v)
    if (std::abs(root.imag()) < kRealRoot * (1 + std::abs(root.real())))
      roots[count++] = root.real();
  std::sort(roots.begin(), roots.begin() + count);
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
