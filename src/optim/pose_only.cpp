#include "optim/pose_only.hpp"

#include <cmath>

#include "geometry/small_systems.hpp"
#include "optim/residual.hpp"

namespace ygslam {
namespace {

constexpr int kLanes = 4;
constexpr double kConverged = 1e-7;  // [m] and [rad]

struct NormalEquations {
  Mat6 H;
  Vec6 g;
  double cost;
};

struct Block {
  Lanes x_m, y_m, z_m;  // of the point, world frame
  WhitenedObservation<Lanes> seen;
  Lanes weight;
  Lanes use_pixel, use_depth;  // weight, or 0 while judged an outlier
};

// Sums over P^T A P (upper triangle; entry (0,1) is always 0) and P^T b, four lanes each.
struct PoseSums {
  Lanes h[20], g[6], cost;

  PoseSums() {
    for (Lanes& sum : h) sum.setZero();
    for (Lanes& sum : g) sum.setZero();
    cost.setZero();
  }

  // With K = [p]x and P = [I -K]: P^T A P = [A, (KA)^T; KA, K (KA)^T], P^T b = [b; K b].
  void add(const CameraNormal<Lanes>& n, const Lanes& x, const Lanes& y, const Lanes& z) {
    const Lanes k00 = y * n.a02, k10 = z * n.a00 - x * n.a02, k20 = -(y * n.a00);
    const Lanes k01 = y * n.a12 - z * n.a11, k11 = -(x * n.a12), k21 = x * n.a11;
    const Lanes k02 = y * n.a22 - z * n.a12, k12 = z * n.a02 - x * n.a22;
    const Lanes k22 = x * n.a12 - y * n.a02;
    h[0] += n.a00, h[1] += n.a02, h[2] += k00, h[3] += k10, h[4] += k20;
    h[5] += n.a11, h[6] += n.a12, h[7] += k01, h[8] += k11, h[9] += k21;
    h[10] += n.a22, h[11] += k02, h[12] += k12, h[13] += k22;
    h[14] += y * k02 - z * k01, h[15] += z * k00 - x * k02, h[16] += x * k01 - y * k00;
    h[17] += z * k10 - x * k12, h[18] += x * k11 - y * k10;
    h[19] += x * k21 - y * k20;
    g[0] += n.b0, g[1] += n.b1, g[2] += n.b2;
    g[3] += y * n.b2 - z * n.b1, g[4] += z * n.b0 - x * n.b2, g[5] += x * n.b1 - y * n.b0;
    cost += n.cost;
  }

  [[nodiscard]] NormalEquations total() const {
    NormalEquations n;
    int k = 0;
    for (int i = 0; i < 6; ++i) {
      for (int j = i; j < 6; ++j) {
        n.H(i, j) = (i == 0 && j == 1) ? 0.0 : h[k++].sum();
        n.H(j, i) = n.H(i, j);
      }
      n.g[i] = g[i].sum();
    }
    n.cost = cost.sum();
    return n;
  }
};

void set_lane(Block& block, int lane, const Camera& camera, const PoseObservation& o) {
  const WhitenedObservation<double> seen = whiten(camera, o.seen);
  block.x_m[lane] = o.p_world.x();
  block.y_m[lane] = o.p_world.y();
  block.z_m[lane] = o.p_world.z();
  block.seen.x[lane] = seen.x;
  block.seen.y[lane] = seen.y;
  block.seen.scale_x[lane] = seen.scale_x;
  block.seen.scale_y[lane] = seen.scale_y;
  block.seen.inverse_depth[lane] = seen.inverse_depth;
  block.seen.scale_depth[lane] = seen.scale_depth;
  block.weight[lane] = o.seen.weight;
}

class PoseProblem {
 public:
  PoseProblem(const Camera& camera, std::span<const PoseObservation> observations)
      : blocks_((observations.size() + kLanes - 1) / kLanes) {
    const Lanes zero = Lanes::Zero();
    for (Block& block : blocks_) {
      block = {zero, zero, zero, {zero, zero, zero, zero, zero, zero}, zero, zero, zero};
    }
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const PoseObservation& o = observations[i];
      if (is_usable(o.seen) && o.p_world.allFinite()) {
        set_lane(blocks_[i / kLanes], static_cast<int>(i % kLanes), camera, o);
      }
    }
  }

  /// All observations in front of the camera take part.
  void use_all(const SE3& T_camera_world) {
    for (Block& block : blocks_) {
      block.use_pixel = block.weight * residual(block, T_camera_world).seen;
      block.use_depth = block.use_pixel;
    }
  }

  /// Judges every observation against the pose. @return how many agree.
  int judge(const SE3& T_camera_world, const PoseOnlyConfig& config) {
    int inliers = 0;
    for (Block& block : blocks_) {
      const Residual<Lanes> r = residual(block, T_camera_world);
      const Lanes chi2_pixel = r.chi2_pixel();
      const Lanes chi2_depth = r.chi2_depth();
      for (int k = 0; k < kLanes; ++k) {
        const bool agrees =
            block.weight[k] > 0 && r.seen[k] > 0 && chi2_pixel[k] <= config.gate_chi2_pixel;
        const bool depth_agrees = agrees && chi2_depth[k] <= config.chi2_depth;
        block.use_pixel[k] = agrees ? block.weight[k] : 0.0;
        block.use_depth[k] = depth_agrees ? block.weight[k] : 0.0;
        inliers += agrees;
      }
    }
    return inliers;
  }

  [[nodiscard]] NormalEquations linearize(const SE3& T_camera_world,
                                          const ResidualKernels& kernels) const {
    PoseSums sums;
    for (const Block& block : blocks_) {
      const Points p = transform(block, T_camera_world);
      const Residual<Lanes> r = residual_at(block.seen, p.x, p.y, p.z);
      sums.add(camera_normal(r, block.use_pixel, block.use_depth, kernels), p.x, p.y, p.z);
    }
    return sums.total();
  }

  [[nodiscard]] bool agrees(std::size_t i) const {
    return blocks_[i / kLanes].use_pixel[static_cast<int>(i % kLanes)] > 0;
  }

  /// Sum of squared normalised reprojection residuals of those that agree.
  [[nodiscard]] double pixel_chi2(const SE3& T_camera_world) const {
    double sum = 0;
    for (const Block& block : blocks_) {
      const Lanes chi2 = residual(block, T_camera_world).chi2_pixel();
      for (int k = 0; k < kLanes; ++k) sum += block.use_pixel[k] > 0 ? chi2[k] : 0.0;
    }
    return sum;
  }

 private:
  struct Points {
    Lanes x, y, z;
  };

  static Points transform(const Block& b, const SE3& T) {
    const Mat3& R = T.R();
    const Vec3& t = T.t();
    return {R(0, 0) * b.x_m + R(0, 1) * b.y_m + R(0, 2) * b.z_m + t.x(),
            R(1, 0) * b.x_m + R(1, 1) * b.y_m + R(1, 2) * b.z_m + t.y(),
            R(2, 0) * b.x_m + R(2, 1) * b.y_m + R(2, 2) * b.z_m + t.z()};
  }

  static Residual<Lanes> residual(const Block& block, const SE3& T) {
    const Points p = transform(block, T);
    return residual_at(block.seen, p.x, p.y, p.z);
  }

  std::vector<Block> blocks_;
};

// Levenberg-Marquardt with Marquardt's scaling; the cost never grows.
SE3 minimise(const PoseProblem& problem, SE3 T, const ResidualKernels& kernels, int iterations) {
  NormalEquations now = problem.linearize(T, kernels);
  double lambda = 1e-5;
  for (int i = 0; i < iterations; ++i) {
    Mat6 damped = now.H;
    damped.diagonal() += lambda * now.H.diagonal() + Vec6::Constant(1e-12);
    const Vec6 step = -SymmetricSystem6(damped).solve(now.g);
    if (!step.allFinite()) break;
    const SE3 T_trial = SE3::exp(step) * T;
    const NormalEquations trial = problem.linearize(T_trial, kernels);
    if (trial.cost <= now.cost) {
      T = T_trial;
      now = trial;
      lambda = std::max(0.1 * lambda, 1e-9);
    } else {
      lambda *= 10.0;
    }
    if (step.cwiseAbs().maxCoeff() < kConverged) break;
  }
  return T.normalized();
}

PoseSolution make_solution(const PoseProblem& problem, const SE3& T, std::size_t count,
                           int inliers) {
  PoseSolution solution;
  solution.T_camera_world = T;
  solution.information = problem.linearize(T, {}).H;
  solution.inlier.resize(count);
  for (std::size_t i = 0; i < count; ++i) solution.inlier[i] = problem.agrees(i) ? 1 : 0;
  solution.inliers = inliers;
  solution.rms = std::sqrt(problem.pixel_chi2(T) / (2.0 * inliers));
  return solution;
}

}  // namespace

std::optional<PoseSolution> solve_pose(const Camera& camera, const SE3& T_camera_world_guess,
                                       std::span<const PoseObservation> observations,
                                       const PoseOnlyConfig& config) {
  if (!T_camera_world_guess.is_finite()) return std::nullopt;
  const ResidualKernels huber = {{std::sqrt(config.chi2_pixel)}, {std::sqrt(config.chi2_depth)}};
  const ResidualKernels tail = {{.tail_dof = config.tail_dof}, {}};
  PoseProblem problem(camera, observations);
  SE3 T = T_camera_world_guess;
  problem.use_all(T);
  int inliers = 0;
  for (int round = 0; round < std::max(1, config.rounds); ++round) {
    const bool robust = round < config.robust_rounds;
    T = minimise(problem, T, robust ? huber : tail, config.iterations);
    if (!T.is_finite()) return std::nullopt;
    inliers = problem.judge(T, config);
    if (inliers < std::max(1, config.min_inliers)) return std::nullopt;
  }
  PoseSolution solution = make_solution(problem, T, observations.size(), inliers);
  if (!solution.information.allFinite() || !std::isfinite(solution.rms)) return std::nullopt;
  return solution;
}

}  // namespace ygslam
