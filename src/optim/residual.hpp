// The residual of observation.hpp, its derivatives and its robust kernels, written once for every
// solver. T is double, or Lanes to treat four observations at a time.
//
// Notation: xi = (rho, omega) is the twist of a left perturbation T <- exp(xi) * T, so that
// d p_cam / d xi = P = [ I  -[p_cam]x ] (Barfoot 2017, eq. 7.191), and d p_cam / d p_world = R.
#pragma once

#include <algorithm>
#include <cmath>

#include "geometry/camera.hpp"
#include "optim/observation.hpp"

namespace ygslam {

/// Four observations side by side.
using Lanes = Eigen::Array<double, 4, 1>;
using Mat36 = Eigen::Matrix<double, 3, 6>;

/// Nearer than this, or behind the camera, a point cannot have been seen.
inline constexpr double kNearestDepth_m = 0.01;
/// Squared residual charged for a point the camera cannot have seen: a constant, without gradient.
inline constexpr double kUnseenChi2 = 1e8;

namespace lanes {
[[nodiscard]] inline double lower(double a, double b) { return std::min(a, b); }
[[nodiscard]] inline double upper(double a, double b) { return std::max(a, b); }
[[nodiscard]] inline double logarithm(double a) { return std::log(a); }
[[nodiscard]] inline Lanes logarithm(const Lanes& a) { return a.log(); }
[[nodiscard]] inline double root(double a) { return std::sqrt(a); }
[[nodiscard]] inline Lanes lower(const Lanes& a, double b) { return a.min(b); }
[[nodiscard]] inline Lanes upper(const Lanes& a, double b) { return a.max(b); }
[[nodiscard]] inline Lanes root(const Lanes& a) { return a.sqrt(); }
}  // namespace lanes

/// An observation on the plane z = 1, with the factors that whiten its residual.
template <class T>
struct WhitenedObservation {
  T x, y;              ///< (ideal_px - c) / f
  T scale_x, scale_y;  ///< f / sigma_px
  T inverse_depth;     ///< [1/m], 0 = not measured
  T scale_depth;       ///< depth_m^2 / sigma_depth_m [m], 0 = not measured
};

/// Finite and with positive standard deviations: fit to take part in a minimisation.
[[nodiscard]] inline bool is_usable(const Observation& seen) {
  const bool pixel = seen.ideal_px.allFinite() && std::isfinite(seen.sigma_px) && seen.sigma_px > 0;
  const bool depth =
      seen.depth_m == 0 || (std::isfinite(seen.depth_m) && seen.depth_m > 0 &&
                            std::isfinite(seen.sigma_depth_m) && seen.sigma_depth_m > 0);
  return pixel && depth && std::isfinite(seen.weight) && seen.weight >= 0;
}

/// @param seen must be usable.
[[nodiscard]] inline WhitenedObservation<double> whiten(const Camera& camera,
                                                        const Observation& seen) {
  const bool has_depth = seen.depth_m > 0;
  return {(seen.ideal_px.x() - camera.cx()) / camera.fx(),
          (seen.ideal_px.y() - camera.cy()) / camera.fy(),
          camera.fx() / seen.sigma_px,
          camera.fy() / seen.sigma_px,
          has_depth ? 1.0 / seen.depth_m : 0.0,
          has_depth ? seen.depth_m * seen.depth_m / seen.sigma_depth_m : 0.0};
}

/// Whitened residual r(p_cam) and the entries of d r / d p_cam that are not zero:
///   [ x_x  0   x_z ]
///   [ 0   y_y  y_z ]
///   [ 0    0  depth_z ]
template <class T>
struct Residual {
  T x, y, depth;
  T x_x, x_z, y_y, y_z, depth_z;
  T seen;  ///< 1 in front of the camera, 0 nearer than kNearestDepth_m or behind

  [[nodiscard]] T chi2_pixel() const { return x * x + y * y; }
  [[nodiscard]] T chi2_depth() const { return depth * depth; }
};

template <class T>
[[nodiscard]] inline Residual<T> residual_at(const WhitenedObservation<T>& o, const T& x_m,
                                             const T& y_m, const T& z_m) {
  Residual<T> r;
  const T inverse_z = 1.0 / lanes::upper(z_m, kNearestDepth_m);
  const T u = x_m * inverse_z;
  const T v = y_m * inverse_z;
  r.x = (u - o.x) * o.scale_x;
  r.y = (v - o.y) * o.scale_y;
  r.depth = (inverse_z - o.inverse_depth) * o.scale_depth;
  r.x_x = o.scale_x * inverse_z;
  r.x_z = -(r.x_x * u);
  r.y_y = o.scale_y * inverse_z;
  r.y_z = -(r.y_y * v);
  r.depth_z = -(o.scale_depth * (inverse_z * inverse_z));
  // A step function without a branch, so that it stays in vector registers.
  r.seen = lanes::lower(lanes::upper(T((z_m - kNearestDepth_m) * 1e15), 0.0), 1.0);
  return r;
}

/// Robust kernel on a squared residual s, off as long as both numbers are infinite. One of:
/// - Huber's, as Ceres defines it: rho(s) = s up to delta^2, then 2 delta sqrt(s) - delta^2;
/// - Cauchy's, as Ceres defines it: rho(s) = c log(1 + s / c) with c = tail_dof, which is up to a
///   factor the likelihood of Student's t, of errors with a long tail (Lange et al. 1989).
///   Not convex.
struct RobustKernel {
  double delta = HUGE_VAL;
  double tail_dof = HUGE_VAL;

  [[nodiscard]] bool is_cauchy() const { return std::isfinite(tail_dof); }

  template <class T>
  [[nodiscard]] T rho(const T& chi2) const {
    if (is_cauchy()) return tail_dof * lanes::logarithm(T(1.0 + chi2 / tail_dof));
    const T norm = lanes::root(chi2);
    const T inner = lanes::lower(norm, delta);
    return inner * (2.0 * norm - inner);
  }
  /// d rho / d chi2: the weight of iteratively reweighted least squares.
  template <class T>
  [[nodiscard]] T weight(const T& chi2) const {
    if (is_cauchy()) return 1.0 / (1.0 + chi2 / tail_dof);
    return lanes::lower(T(delta / lanes::root(chi2)), 1.0);
  }
};

struct ResidualKernels {
  RobustKernel pixel, depth;
};

/// Normal equations of one observation in the camera frame: A = J^T W J (symmetric, A01 = 0) and
/// b = J^T W r with J = d r / d p_cam; the pose's share is P^T A P and P^T b, the point's
/// R^T A R and R^T b.
template <class T>
struct CameraNormal {
  T a00, a02, a11, a12, a22;
  T b0, b1, b2;
  T cost;  ///< 1/2 of the weighted, robustified squared residual
};

/// @param use_pixel, use_depth the observation's weight where that part takes part, else 0.
template <class T>
[[nodiscard]] inline CameraNormal<T> camera_normal(const Residual<T>& r, const T& use_pixel,
                                                   const T& use_depth,
                                                   const ResidualKernels& kernels) {
  const T chi2_pixel = r.chi2_pixel();
  const T chi2_depth = r.chi2_depth();
  const T wp = use_pixel * r.seen * kernels.pixel.weight(chi2_pixel);
  const T wd = use_depth * r.seen * kernels.depth.weight(chi2_depth);
  CameraNormal<T> n;
  const T wx_x = wp * r.x_x;
  const T wy_y = wp * r.y_y;
  n.a00 = wx_x * r.x_x;
  n.a02 = wx_x * r.x_z;
  n.a11 = wy_y * r.y_y;
  n.a12 = wy_y * r.y_z;
  n.a22 = wp * (r.x_z * r.x_z + r.y_z * r.y_z) + wd * (r.depth_z * r.depth_z);
  n.b0 = wx_x * r.x;
  n.b1 = wy_y * r.y;
  n.b2 = wp * (r.x_z * r.x + r.y_z * r.y) + wd * (r.depth_z * r.depth);
  n.cost = 0.5 * (use_pixel * r.seen * kernels.pixel.rho(chi2_pixel) +
                  use_depth * r.seen * kernels.depth.rho(chi2_depth) +
                  use_pixel * (1.0 - r.seen) * kernels.pixel.rho(kUnseenChi2));
  return n;
}

/// The residual as observation.hpp states it. @return third entry 0 where there is no depth.
[[nodiscard]] inline Vec3 residual_vector(const Camera& camera, const Observation& seen,
                                          const Vec3& p_cam) {
  const auto r = residual_at(whiten(camera, seen), p_cam.x(), p_cam.y(), p_cam.z());
  return {r.x, r.y, r.depth};
}

/// d r / d p_cam.
[[nodiscard]] inline Mat3 camera_jacobian(const Camera& camera, const Observation& seen,
                                          const Vec3& p_cam) {
  const auto r = residual_at(whiten(camera, seen), p_cam.x(), p_cam.y(), p_cam.z());
  Mat3 J;
  J << r.x_x, 0, r.x_z, 0, r.y_y, r.y_z, 0, 0, r.depth_z;
  return J;
}

/// d r / d xi for T <- exp(xi) * T.
[[nodiscard]] inline Mat36 pose_jacobian(const Camera& camera, const Observation& seen,
                                         const Vec3& p_cam) {
  Mat36 P;
  P << Mat3::Identity(), -skew(p_cam);
  return camera_jacobian(camera, seen, p_cam) * P;
}

/// d r / d p_world.
[[nodiscard]] inline Mat3 point_jacobian(const Camera& camera, const Observation& seen,
                                         const SE3& T_camera_world, const Vec3& p_world) {
  return camera_jacobian(camera, seen, T_camera_world * p_world) * T_camera_world.R();
}

}  // namespace ygslam
