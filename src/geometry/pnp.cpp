#include "geometry/pnp.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/small_systems.hpp"

namespace ygslam {
namespace {

constexpr double kNearestDepth_m = 0.01;
constexpr int kP3pPoints = 3;

struct PoseScore {
  int inliers = 0;
  double agreement = 0;  // sum over inliers of 1 - squared normalised error, as MSAC

  [[nodiscard]] bool is_better_than(const PoseScore& other) const {
    return agreement > other.agreement;
  }
};

class PnpRansac {
 public:
  PnpRansac(const Camera& camera, std::span<const PnpPoint> points, const PnpConfig& config)
      : camera_(camera), points_(points), config_(config) {
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      if (points[i].p_world.allFinite() && points[i].ideal_px.allFinite()) usable_.push_back(i);
    }
  }

  std::optional<PnpResult> run(Rng& rng) {
    const int least = std::max(kP3pPoints, config_.ransac.min_inliers);
    if (static_cast<int>(usable_.size()) < least) return std::nullopt;
    int wanted = config_.ransac.max_iterations;
    int drawn = 0;
    for (; drawn < wanted; ++drawn) {
      if (!try_sample(draw_sample<kP3pPoints>(static_cast<std::uint32_t>(usable_.size()), rng)))
        continue;
      const double share = static_cast<double>(best_.inliers) / static_cast<double>(usable_.size());
      wanted = ransac_iterations(share, kP3pPoints, config_.ransac.confidence,
                                 config_.ransac.max_iterations);
    }
    if (best_.inliers < least) return std::nullopt;
    PnpResult result{T_best_, std::vector<std::uint8_t>(points_.size(), 0), best_.inliers, drawn};
    for (const std::uint32_t i : usable_)
      result.inlier[i] = error_of(T_best_, points_[i]) < 1 ? 1 : 0;
    return result;
  }

 private:
  [[nodiscard]] static bool has_depth(const PnpPoint& p) {
    return p.depth_m > kNearestDepth_m && std::isfinite(p.depth_m);
  }

  /// Squared error, 1 at the threshold: of the image, or of the depth where that is worse.
  [[nodiscard]] double error_of(const SE3& T, const PnpPoint& p) const {
    const Vec3 p_cam = T * p.p_world;
    if (!(p_cam.z() > kNearestDepth_m)) return HUGE_VAL;
    const double threshold_px = config_.ransac.threshold_px;
    const double pixel =
        (camera_.project(p_cam) - p.ideal_px).squaredNorm() / (threshold_px * threshold_px);
    if (!has_depth(p)) return pixel;
    const double depth = (1 / p_cam.z() - 1 / p.depth_m) / config_.threshold_inverse_depth;
    return std::max(pixel, depth * depth);
  }

  [[nodiscard]] PoseScore score_of(const SE3& T) const {
    PoseScore score;
    for (const std::uint32_t i : usable_) {
      const double error = error_of(T, points_[i]);
      if (!(error < 1)) continue;
      ++score.inliers;
      score.agreement += 1 - error;
    }
    return score;
  }

  /// Distances between points do not depend on the pose: do the measured depths allow them?
  [[nodiscard]] bool is_congruent(const std::array<std::uint32_t, kP3pPoints>& sample) const {
    for (int i = 0; i < kP3pPoints; ++i) {
      const PnpPoint& a = points_[usable_[sample[i]]];
      const PnpPoint& b = points_[usable_[sample[(i + 1) % kP3pPoints]]];
      if (!has_depth(a) || !has_depth(b)) continue;
      const double measured_m =
          (camera_.unproject(a.ideal_px, a.depth_m) - camera_.unproject(b.ideal_px, b.depth_m))
              .norm();
      const double known_m = (a.p_world - b.p_world).norm();
      const double tolerance_m =
          config_.threshold_inverse_depth * (a.depth_m * a.depth_m + b.depth_m * b.depth_m);
      if (!(std::abs(measured_m - known_m) < tolerance_m)) return false;
    }
    return true;
  }

  /// @return true if the sample gave a better pose than the best so far.
  bool try_sample(const std::array<std::uint32_t, kP3pPoints>& sample) {
    if (!is_congruent(sample)) return false;
    std::array<Vec3, kP3pPoints> rays, p_world;
    for (int i = 0; i < kP3pPoints; ++i) {
      const PnpPoint& p = points_[usable_[sample[i]]];
      rays[i] = camera_.unproject(p.ideal_px, 1.0).normalized();
      p_world[i] = p.p_world;
    }
    const P3pSolutions solutions = solve_p3p(rays, p_world);
    bool is_better = false;
    for (int k = 0; k < solutions.count; ++k) {
      const SE3& T = solutions.T_camera_world[k];
      const PoseScore score = score_of(T);
      if (!score.is_better_than(best_)) continue;
      is_better = true;
      T_best_ = T;
      best_ = score;
      improve_best();
    }
    return is_better;
  }

  /// Gauss-Newton on the inliers, as long as the pose gets better.
  void improve_best() {
    for (int i = 0; i < 4; ++i) {
      Mat6 H = Mat6::Identity() * 1e-9;
      Vec6 g = Vec6::Zero();
      for (const std::uint32_t k : usable_) {
        if (error_of(T_best_, points_[k]) < 1) add_normal_equations(points_[k], H, g);
      }
      const Vec6 step = -SymmetricSystem6(H).solve(g);
      if (!step.allFinite()) return;
      const SE3 T = (SE3::exp(step) * T_best_).normalized();
      const PoseScore score = score_of(T);
      if (!score.is_better_than(best_)) return;
      T_best_ = T;
      best_ = score;
    }
  }

  /// Of the residuals divided by their thresholds; left perturbation, translation first.
  void add_normal_equations(const PnpPoint& p, Mat6& H, Vec6& g) const {
    const Vec3 q = T_best_ * p.p_world;
    const double w = 1 / config_.ransac.threshold_px;
    const Vec2 pixel = w * (camera_.project(q) - p.ideal_px);
    Vec3 residual(pixel.x(), pixel.y(), 0);
    Mat3 J_cam = Mat3::Zero();
    J_cam << w * camera_.fx() / q.z(), 0, -w * camera_.fx() * q.x() / (q.z() * q.z()),  //
        0, w * camera_.fy() / q.z(), -w * camera_.fy() * q.y() / (q.z() * q.z()), 0, 0, 0;
    if (has_depth(p)) {
      residual.z() = (1 / q.z() - 1 / p.depth_m) / config_.threshold_inverse_depth;
      J_cam(2, 2) = -1 / (q.z() * q.z() * config_.threshold_inverse_depth);
    }
    Eigen::Matrix<double, 3, 6> J;
    J << J_cam, -J_cam * skew(q);
    H.noalias() += J.transpose() * J;
    g.noalias() += J.transpose() * residual;
  }

  const Camera& camera_;
  std::span<const PnpPoint> points_;
  const PnpConfig& config_;
  std::vector<std::uint32_t> usable_;
  SE3 T_best_;
  PoseScore best_;
};

}  // namespace

std::optional<PnpResult> solve_pnp_ransac(const Camera& camera, std::span<const PnpPoint> points,
                                          const PnpConfig& config, Rng& rng) {
  return PnpRansac(camera, points, config).run(rng);
}

}  // namespace ygslam
