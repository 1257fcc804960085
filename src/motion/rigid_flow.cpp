#include "motion/rigid_flow.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr double kMinDepthM = 0.05;    // nearer than any lens focuses
constexpr double kFirstScalePx = 4.0;  // of the kernel, at least
constexpr double kMostLimits = 2.0;    // bad measurements stretch the limit no further

// Where nothing is known about the depth it lies in between.
constexpr DepthRange kAnyDepth{0.3F, 50.0F};

bool usable(const RigidPoint& p) {
  return p.depth_m > 0 && std::isfinite(p.depth_m) && p.previous_px.allFinite() &&
         p.current_px.allFinite();
}

/// Residual at the point's own depth [px], negative if it falls behind the camera.
double residual_px(const Camera& camera, const SE3& T, const RigidPoint& point) {
  const Vec3 p = T * camera.unproject(point.previous_px, point.depth_m);
  return p.z() < kMinDepthM ? -1 : (camera.project(p) - point.current_px).norm();
}

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 1e-12 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

double median_residual_px(const Camera& camera, const SE3& T, std::span<const RigidPoint> voters) {
  std::vector<double> residuals;
  residuals.reserve(voters.size());
  for (const RigidPoint& p : voters)
    if (const double r = residual_px(camera, T, p); r >= 0) residuals.push_back(r);
  if (residuals.empty()) return 0;
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return *middle;
}

std::vector<RigidPoint> choose(std::span<const RigidPoint> points,
                               std::span<const std::uint8_t> voter) {
  CHECK(points.size() == voter.size());
  std::vector<RigidPoint> voters;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (voter[i] && usable(points[i])) voters.push_back(points[i]);
  return voters;
}

RigidFit judge(const Camera& camera, std::span<const RigidPoint> voters,
               const SE3& T_current_previous, const RigidFlowConfig& config) {
  RigidFit fit;
  fit.T_current_previous = T_current_previous;
  fit.voters = static_cast<int>(voters.size());
  fit.limit_px =
      std::clamp(config.limit_medians * median_residual_px(camera, T_current_previous, voters),
                 config.limit_px, kMostLimits * config.limit_px);
  double sum2 = 0;
  for (const RigidPoint& p : voters) {
    const double r = residual_px(camera, T_current_previous, p);
    if (r < 0 || r > fit.limit_px) continue;
    sum2 += r * r;
    ++fit.inliers;
  }
  fit.rms_px = fit.inliers > 0 ? std::sqrt(sum2 / fit.inliers) : 0;
  return fit;
}

struct NormalEquations {
  Mat6 H = Mat6::Zero();
  Vec6 b = Vec6::Zero();
};

/// Left perturbation exp(xi) * T, translation first.
NormalEquations linearise(const Camera& camera, const SE3& T, std::span<const RigidPoint> voters,
                          double scale_px) {
  NormalEquations eq;
  for (const RigidPoint& point : voters) {
    const Vec3 p = T * camera.unproject(point.previous_px, point.depth_m);
    if (p.z() < kMinDepthM) continue;
    const Vec2 r = camera.project(p) - point.current_px;
    const double s2 = scale_px * scale_px;
    const double root = s2 / (s2 + r.squaredNorm());
    const double iz = 1.0 / p.z();
    const double x = p.x() * iz;
    const double y = p.y() * iz;
    Eigen::Matrix<double, 2, 6> J;
    J << iz, 0, -x * iz, -x * y, 1 + x * x, -y, 0, iz, -y * iz, -1 - y * y, x * y, x;
    J.row(0) *= camera.fx();
    J.row(1) *= camera.fy();
    const double weight = root * root;
    eq.H.noalias() += weight * J.transpose() * J;
    eq.b.noalias() -= weight * J.transpose() * r;
  }
  return eq;
}

}  // namespace

DepthRange depth_range(const DepthImage& depth_m, const Eigen::Vector2f& uv_px, int radius_px) {
  if (!uv_px.allFinite() || uv_px.cwiseAbs().maxCoeff() > 1e6F) return {};
  const int u = static_cast<int>(std::lround(uv_px.x()));
  const int v = static_cast<int>(std::lround(uv_px.y()));
  DepthRange range{1e9F, 0};
  for (int y = std::max(v - radius_px, 0); y <= std::min(v + radius_px, depth_m.height() - 1);
       ++y) {
    for (int x = std::max(u - radius_px, 0); x <= std::min(u + radius_px, depth_m.width() - 1);
         ++x) {
      const float d = depth_m.at(x, y);
      if (!(d > 0) || !std::isfinite(d)) continue;
      range.min_m = std::min(range.min_m, d);
      range.max_m = std::max(range.max_m, d);
    }
  }
  return range.max_m > 0 ? range : DepthRange{};
}

RigidResidual rigid_residual(const Camera& camera, const SE3& T_current_previous,
                             const RigidPoint& point) {
  if (!point.previous_px.allFinite() || !point.current_px.allFinite()) return {};
  const DepthRange& range = point.range.max_m > 0 ? point.range : kAnyDepth;
  const Vec3 near = T_current_previous * camera.unproject(point.previous_px, range.min_m);
  const Vec3 far = T_current_previous * camera.unproject(point.previous_px, range.max_m);
  if (near.z() < kMinDepthM || far.z() < kMinDepthM) return {};
  RigidResidual residual;
  residual.any_depth_px =
      distance_to_segment(point.current_px, camera.project(near), camera.project(far));
  residual.own_depth_px =
      usable(point) ? residual_px(camera, T_current_previous, point) : residual.any_depth_px;
  return residual;
}

RigidFit judge_rigid_flow(const Camera& camera, std::span<const RigidPoint> points,
                          std::span<const std::uint8_t> voter, const SE3& T_current_previous,
                          const RigidFlowConfig& config) {
  return judge(camera, choose(points, voter), T_current_previous, config);
}

std::optional<RigidFit> fit_rigid_flow(const Camera& camera, std::span<const RigidPoint> points,
                                       std::span<const std::uint8_t> voter, const SE3& guess,
                                       const RigidFlowConfig& config) {
  const std::vector<RigidPoint> voters = choose(points, voter);
  if (static_cast<int>(voters.size()) < config.min_points) return std::nullopt;

  RigidFit fit;
  fit.T_current_previous = guess;
  double scale_px = std::max(2.0 * median_residual_px(camera, guess, voters), kFirstScalePx);
  for (int i = 0; i < config.iterations; ++i) {
    const NormalEquations eq = linearise(camera, fit.T_current_previous, voters, scale_px);
    const Eigen::LDLT<Mat6> solver(eq.H);
    const Vec6 step = solver.solve(eq.b);
    if (solver.info() != Eigen::Success || !step.allFinite()) return std::nullopt;
    fit.T_current_previous = SE3::exp(step) * fit.T_current_previous;
    scale_px = std::max(0.5 * scale_px, config.final_scale_px);
  }
  fit = judge(camera, voters, fit.T_current_previous, config);
  if (2 * fit.inliers < fit.voters || !fit.T_current_previous.is_finite()) return std::nullopt;
  return fit;
}

}  // namespace ygslam
