#include "motion/checks/ego_motion.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "core/statistics.hpp"
#include "geometry/small_systems.hpp"

namespace ygslam {
namespace {

constexpr double kMinDepth_m = 0.05;    // nearer than any lens focuses
constexpr double kFirstScale_px = 4.0;  // of the kernel, at least
constexpr double kSettledStep = 1e-5;   // [m and rad]: less than 0.01 px at a metre
constexpr double kMostLimits = 2.0;     // bad measurements stretch the limit no further

// Where nothing is known about the depth it lies in between.
constexpr DepthRange kAnyDepth{0.3F, 50.0F};

bool usable(const FollowedPoint& p) {
  return p.depth_m > 0 && std::isfinite(p.depth_m) && p.previous_px.allFinite() &&
         p.current_px.allFinite();
}

/// A point that takes part in the fit.
struct StaticCandidate {
  Vec3 p_previous;  // in the previous camera's frame [m]
  Vec2 current_px;
};

/// Residual [px], negative if the point falls behind the camera.
double residual_px(const Camera& camera, const SE3& T, const StaticCandidate& candidate) {
  const Vec3 p = T * candidate.p_previous;
  return p.z() < kMinDepth_m ? -1 : (camera.project(p) - candidate.current_px).norm();
}

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 1e-12 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

double median_residual_px(const Camera& camera, const SE3& T,
                          std::span<const StaticCandidate> candidates) {
  std::vector<double> residuals;
  residuals.reserve(candidates.size());
  for (const StaticCandidate& v : candidates)
    if (const double r = residual_px(camera, T, v); r >= 0) residuals.push_back(r);
  return residuals.empty() ? 0 : median(residuals);
}

std::vector<StaticCandidate> choose(const Camera& camera, std::span<const FollowedPoint> points,
                                    std::span<const std::uint8_t> candidate) {
  CHECK(points.size() == candidate.size());
  std::vector<StaticCandidate> candidates;
  candidates.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const FollowedPoint& p = points[i];
    if (candidate[i] && usable(p))
      candidates.push_back({camera.unproject(p.previous_px, p.depth_m), p.current_px});
  }
  return candidates;
}

EgoMotion assess(const Camera& camera, std::span<const StaticCandidate> candidates,
                 const SE3& T_current_previous, const EgoMotionConfig& config) {
  EgoMotion fit;
  fit.T_current_previous = T_current_previous;
  fit.candidates = static_cast<int>(candidates.size());
  fit.limit_px =
      std::clamp(config.limit_medians * median_residual_px(camera, T_current_previous, candidates),
                 config.limit_px, kMostLimits * config.limit_px);
  for (const StaticCandidate& v : candidates) {
    const double r = residual_px(camera, T_current_previous, v);
    fit.inliers += r < 0 || r > fit.limit_px ? 0 : 1;
  }
  return fit;
}

struct NormalEquations {
  Mat6 H = Mat6::Zero();
  Vec6 b = Vec6::Zero();
};

/// Left perturbation exp(xi) * T, translation first.
NormalEquations linearise(const Camera& camera, const SE3& T,
                          std::span<const StaticCandidate> candidates, double scale_px) {
  NormalEquations eq;
  const double s2 = scale_px * scale_px;
  for (const StaticCandidate& candidate : candidates) {
    const Vec3 p = T * candidate.p_previous;
    if (p.z() < kMinDepth_m) continue;
    const double iz = 1.0 / p.z();
    const double x = p.x() * iz;
    const double y = p.y() * iz;
    const Vec2 r = camera.project(p) - candidate.current_px;
    const double root = s2 / (s2 + r.squaredNorm());
    const double weight = root * root;
    Vec6 u;  // gradients of the two residuals
    Vec6 v;
    u << iz, 0, -x * iz, -x * y, 1 + x * x, -y;
    v << 0, iz, -y * iz, -1 - y * y, x * y, x;
    u *= camera.fx();
    v *= camera.fy();
    const Vec6 weighted_u = weight * u;
    const Vec6 weighted_v = weight * v;
    eq.H.noalias() += weighted_u * u.transpose();
    eq.H.noalias() += weighted_v * v.transpose();
    eq.b -= r.x() * weighted_u + r.y() * weighted_v;
  }
  return eq;
}

}  // namespace

EgoMotionResidual ego_motion_residual(const Camera& camera, const SE3& T_current_previous,
                                      const FollowedPoint& point) {
  if (!point.previous_px.allFinite() || !point.current_px.allFinite()) return {};
  const DepthRange& range = point.range.max_m > 0 ? point.range : kAnyDepth;
  const Vec3 near = T_current_previous * camera.unproject(point.previous_px, range.min_m);
  const Vec3 far = T_current_previous * camera.unproject(point.previous_px, range.max_m);
  if (near.z() < kMinDepth_m || far.z() < kMinDepth_m) return {};
  EgoMotionResidual residual;
  residual.any_depth_px =
      distance_to_segment(point.current_px, camera.project(near), camera.project(far));
  residual.own_depth_px =
      usable(point)
          ? residual_px(camera, T_current_previous,
                        {camera.unproject(point.previous_px, point.depth_m), point.current_px})
          : residual.any_depth_px;
  return residual;
}

std::optional<EgoMotion> fit_ego_motion(const Camera& camera, std::span<const FollowedPoint> points,
                                        std::span<const std::uint8_t> candidate, const SE3& guess,
                                        const EgoMotionConfig& config) {
  const std::vector<StaticCandidate> candidates = choose(camera, points, candidate);
  if (static_cast<int>(candidates.size()) < config.min_points) return std::nullopt;

  EgoMotion fit;
  fit.T_current_previous = guess;
  double scale_px = std::max(2.0 * median_residual_px(camera, guess, candidates), kFirstScale_px);
  for (int i = 0; i < config.iterations; ++i) {
    const NormalEquations eq = linearise(camera, fit.T_current_previous, candidates, scale_px);
    const SymmetricSystem6 system(eq.H);
    const Vec6 step = system.solve(eq.b);
    if (!system.is_decomposed() || !step.allFinite()) return std::nullopt;
    fit.T_current_previous = SE3::exp(step) * fit.T_current_previous;
    const bool settled = scale_px <= config.final_scale_px && step.norm() < kSettledStep;
    if (settled) break;
    scale_px = std::max(0.5 * scale_px, config.final_scale_px);
  }
  fit = assess(camera, candidates, fit.T_current_previous, config);
  if (2 * fit.inliers < fit.candidates || !fit.T_current_previous.is_finite()) return std::nullopt;
  return fit;
}

}  // namespace ygslam
