#include "motion/rigid_flow.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#ifdef __AVX2__
#include <immintrin.h>
#endif

#include "core/check.hpp"

namespace ygslam {
namespace {

constexpr float kFarthestM = 1e9F;     // stands for "no depth seen"
constexpr double kMinDepthM = 0.05;    // nearer than any lens focuses
constexpr double kFirstScalePx = 4.0;  // of the kernel, at least
constexpr double kSettledStep = 1e-5;  // [m and rad]: less than 0.01 px at a metre
constexpr double kMostLimits = 2.0;    // bad measurements stretch the limit no further

// Where nothing is known about the depth it lies in between.
constexpr DepthRange kAnyDepth{0.3F, 50.0F};

bool usable(const RigidPoint& p) {
  return p.depth_m > 0 && std::isfinite(p.depth_m) && p.previous_px.allFinite() &&
         p.current_px.allFinite();
}

/// A point that takes part in the fit.
struct Voter {
  Vec3 p_previous;  // in the previous camera's frame [m]
  Vec2 current_px;
};

/// Residual [px], negative if the point falls behind the camera.
double residual_px(const Camera& camera, const SE3& T, const Voter& voter) {
  const Vec3 p = T * voter.p_previous;
  return p.z() < kMinDepthM ? -1 : (camera.project(p) - voter.current_px).norm();
}

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 1e-12 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).norm();
}

double median_residual_px(const Camera& camera, const SE3& T, std::span<const Voter> voters) {
  std::vector<double> residuals;
  residuals.reserve(voters.size());
  for (const Voter& v : voters)
    if (const double r = residual_px(camera, T, v); r >= 0) residuals.push_back(r);
  if (residuals.empty()) return 0;
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return *middle;
}

std::vector<Voter> choose(const Camera& camera, std::span<const RigidPoint> points,
                          std::span<const std::uint8_t> voter) {
  CHECK(points.size() == voter.size());
  std::vector<Voter> voters;
  voters.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const RigidPoint& p = points[i];
    if (voter[i] && usable(p))
      voters.push_back({camera.unproject(p.previous_px, p.depth_m), p.current_px});
  }
  return voters;
}

RigidFit judge(const Camera& camera, std::span<const Voter> voters, const SE3& T_current_previous,
               const RigidFlowConfig& config) {
  RigidFit fit;
  fit.T_current_previous = T_current_previous;
  fit.voters = static_cast<int>(voters.size());
  fit.limit_px =
      std::clamp(config.limit_medians * median_residual_px(camera, T_current_previous, voters),
                 config.limit_px, kMostLimits * config.limit_px);
  double sum2 = 0;
  for (const Voter& v : voters) {
    const double r = residual_px(camera, T_current_previous, v);
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
NormalEquations linearise(const Camera& camera, const SE3& T, std::span<const Voter> voters,
                          double scale_px) {
  NormalEquations eq;
  const double s2 = scale_px * scale_px;
  for (const Voter& voter : voters) {
    const Vec3 p = T * voter.p_previous;
    if (p.z() < kMinDepthM) continue;
    const double iz = 1.0 / p.z();
    const double x = p.x() * iz;
    const double y = p.y() * iz;
    const Vec2 r = camera.project(p) - voter.current_px;
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

/// Where no depth is known, minimum and maximum stay as they were.
void widen(DepthRange& range, float d) {
  const bool known = d > 0 && d < kFarthestM;  // false for NaN
  range.min_m = std::min(range.min_m, known ? d : kFarthestM);
  range.max_m = std::max(range.max_m, known ? d : 0.0F);
}

#ifdef __AVX2__
/// Eight columns at once, of which those of the square count.
DepthRange inner_depth_range(const DepthImage& depth_m, int u, int v, int radius_px) {
  const __m256 none = _mm256_setzero_ps();
  const __m256 farthest = _mm256_set1_ps(kFarthestM);
  const __m256i column = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  const __m256 counts =
      _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(2 * radius_px + 1), column));
  __m256 min_m = farthest;
  __m256 max_m = none;
  for (int y = v - radius_px; y <= v + radius_px; ++y) {
    const __m256 d = _mm256_loadu_ps(depth_m.row(y) + u - radius_px);
    const __m256 positive = _mm256_cmp_ps(d, none, _CMP_GT_OQ);
    const __m256 finite = _mm256_cmp_ps(d, farthest, _CMP_LT_OQ);
    const __m256 known = _mm256_and_ps(_mm256_and_ps(positive, finite), counts);
    min_m = _mm256_min_ps(min_m, _mm256_blendv_ps(farthest, d, known));
    max_m = _mm256_max_ps(max_m, _mm256_and_ps(d, known));
  }
  alignas(32) std::array<float, 8> low;
  alignas(32) std::array<float, 8> high;
  _mm256_store_ps(low.data(), min_m);
  _mm256_store_ps(high.data(), max_m);
  DepthRange range{kFarthestM, 0};
  for (std::size_t k = 0; k < 8; ++k) {
    range.min_m = std::min(range.min_m, low[k]);
    range.max_m = std::max(range.max_m, high[k]);
  }
  return range.max_m > 0 ? range : DepthRange{};
}
#endif

}  // namespace

DepthRange depth_range(const DepthImage& depth_m, const Eigen::Vector2f& uv_px, int radius_px) {
  if (!uv_px.allFinite() || uv_px.cwiseAbs().maxCoeff() > 1e6F) return {};
  const int u = static_cast<int>(std::lround(uv_px.x()));
  const int v = static_cast<int>(std::lround(uv_px.y()));
#ifdef __AVX2__
  if (radius_px >= 0 && radius_px <= 3 && u >= radius_px && v >= radius_px &&
      u - radius_px + 8 <= depth_m.width() && v + radius_px < depth_m.height())
    return inner_depth_range(depth_m, u, v, radius_px);
#endif
  DepthRange range{kFarthestM, 0};
  for (int y = std::max(v - radius_px, 0); y <= std::min(v + radius_px, depth_m.height() - 1); ++y)
    for (int x = std::max(u - radius_px, 0); x <= std::min(u + radius_px, depth_m.width() - 1); ++x)
      widen(range, depth_m.at(x, y));
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
      usable(point)
          ? residual_px(camera, T_current_previous,
                        {camera.unproject(point.previous_px, point.depth_m), point.current_px})
          : residual.any_depth_px;
  return residual;
}

RigidFit judge_rigid_flow(const Camera& camera, std::span<const RigidPoint> points,
                          std::span<const std::uint8_t> voter, const SE3& T_current_previous,
                          const RigidFlowConfig& config) {
  return judge(camera, choose(camera, points, voter), T_current_previous, config);
}

std::optional<RigidFit> fit_rigid_flow(const Camera& camera, std::span<const RigidPoint> points,
                                       std::span<const std::uint8_t> voter, const SE3& guess,
                                       const RigidFlowConfig& config) {
  const std::vector<Voter> voters = choose(camera, points, voter);
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
    const bool settled = scale_px <= config.final_scale_px && step.norm() < kSettledStep;
    if (settled) break;
    scale_px = std::max(0.5 * scale_px, config.final_scale_px);
  }
  fit = judge(camera, voters, fit.T_current_previous, config);
  if (2 * fit.inliers < fit.voters || !fit.T_current_previous.is_finite()) return std::nullopt;
  return fit;
}

}  // namespace ygslam
