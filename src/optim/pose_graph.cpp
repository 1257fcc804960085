#include "optim/pose_graph.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "optim/pose_graph_system.hpp"
#include "optim/stop_flag.hpp"

namespace ygslam {
namespace {

constexpr double kFirstGraphLambda = 1e-6;
constexpr double kLeastGraphLambda = 1e-9;
constexpr double kLargestGraphLambda = 1e8;
constexpr int kIterationsPerLevel = 1;  // two give the same weights in twice the time
constexpr double kLastMu = 1e4;         // from here on a weight between 0 and 1 is a tie
constexpr int kJudgements = 10;

// Weight of truncated least squares at the level mu (Yang et al. 2020, eq. 14).
double truncated_weight(double chi2, double inlier_chi2, double mu) {
  if (chi2 <= mu / (mu + 1) * inlier_chi2) return 1;
  if (chi2 >= (mu + 1) / mu * inlier_chi2) return 0;
  return std::clamp(std::sqrt(inlier_chi2 * mu * (mu + 1) / chi2) - mu, 0.0, 1.0);
}

class PoseGraphOptimizer {
 public:
  PoseGraphOptimizer(const PoseGraph& graph, const PoseGraphConfig& config,
                     const std::atomic<bool>* abort)
      : graph_(graph),
        config_(config),
        abort_(abort),
        system_(graph),
        poses_(graph.T_camera_world),
        weight_(graph.edges.size(), 1.0) {
    system_.chi2(poses_, chi2_);
  }

  PoseGraphResult run() {
    PoseGraphResult result;
    result.initial_cost = cost_of(chi2_, poses_);
    if (std::isfinite(result.initial_cost)) {
      if (config_.gnc) graduate();
      result.converged = minimise(config_.max_iterations) && settle();
    }
    result.cost = cost_of(chi2_, poses_);
    result.T_camera_world = poses_;
    result.edge_weight = weight_;
    result.iterations = iterations_;
    return result;
  }

 private:
  // From a nearly convex cost to truncated least squares, each level from the poses of the last.
  void graduate() {
    double largest_chi2 = 0;
    for (std::size_t i = 0; i < weight_.size(); ++i) {
      if (graph_.edges[i].robust) largest_chi2 = std::max(largest_chi2, chi2_[i]);
    }
    if (largest_chi2 <= config_.inlier_chi2) return;
    double mu = config_.inlier_chi2 / (2 * largest_chi2 - config_.inlier_chi2);
    for (; mu < kLastMu && !is_over(); mu *= config_.gnc_growth) {
      weigh([&](double chi2) { return truncated_weight(chi2, config_.inlier_chi2, mu); });
      if (std::ranges::all_of(weight_, [](double w) { return w == 0 || w == 1; })) return;
      (void)minimise(kIterationsPerLevel);
    }
  }

  // Robust edges are in or out; at the optimum each must be where its residual says.
  // @return false if stopped before.
  bool settle() {
    if (!config_.gnc) return true;
    const auto in_or_out = [&](double chi2) { return chi2 <= config_.inlier_chi2 ? 1.0 : 0.0; };
    for (int i = 0; i < kJudgements; ++i) {
      if (!weigh(in_or_out)) return true;
      if (!minimise(config_.max_iterations)) return false;
    }
    return false;
  }

  // @return true if a weight changed.
  template <class F>
  bool weigh(F&& weight_of_chi2) {
    bool is_changed = false;
    for (std::size_t i = 0; i < weight_.size(); ++i) {
      if (!graph_.edges[i].robust) continue;
      const double weight = weight_of_chi2(chi2_[i]);
      is_changed |= weight != weight_[i];
      weight_[i] = weight;
    }
    return is_changed;
  }

  [[nodiscard]] double cost_of(const std::vector<double>& chi2,
                               const std::vector<SE3>& poses) const {
    double sum = 0;
    for (std::size_t i = 0; i < chi2.size(); ++i) sum += weight_[i] * chi2[i];
    return 0.5 * sum + direction_cost(graph_.directions, poses);
  }

  [[nodiscard]] bool is_over() const {
    return iterations_ >= config_.max_iterations || is_stopped(abort_);
  }

  // Levenberg-Marquardt with Marquardt's scaling, weights as they are. @return false if it ended
  // before the optimum.
  bool minimise(int iterations) {
    if (!system_.has_unknowns()) return true;
    double cost = cost_of(chi2_, poses_);
    bool is_linearized = false;
    for (int i = 0; i < iterations && lambda_ < kLargestGraphLambda && !is_over(); ++i) {
      if (!is_linearized) system_.linearize(poses_, weight_);
      is_linearized = true;
      ++iterations_;
      const bool solved = system_.solve(lambda_, abort_);
      // What an undamped step would be, to a factor.
      if (solved && (1 + lambda_) * system_.largest_step() <= config_.step_tolerance) return true;
      if (solved) system_.apply_step(poses_, trial_poses_);
      if (solved) system_.chi2(trial_poses_, trial_chi2_);
      const double trial_cost = solved ? cost_of(trial_chi2_, trial_poses_) : HUGE_VAL;
      if (!(trial_cost <= cost)) {
        if (solved && std::abs(trial_cost - cost) < 1e-12 * cost) return true;  // rounding
        lambda_ *= 10;
        continue;
      }
      const double decrease = cost - trial_cost;
      std::swap(poses_, trial_poses_);
      std::swap(chi2_, trial_chi2_);
      cost = trial_cost;
      is_linearized = false;
      lambda_ = std::max(0.1 * lambda_, kLeastGraphLambda);
      if (decrease <= config_.relative_decrease * cost) return true;
    }
    lambda_ = std::min(lambda_, 1.0);  // other weights, another try
    return false;
  }

  const PoseGraph& graph_;
  const PoseGraphConfig& config_;
  const std::atomic<bool>* abort_;
  PoseGraphSystem system_;
  std::vector<SE3> poses_, trial_poses_;
  std::vector<double> weight_;
  std::vector<double> chi2_, trial_chi2_;  // per edge, at poses_ and trial_poses_
  double lambda_ = kFirstGraphLambda;
  int iterations_ = 0;
};

}  // namespace

PoseGraphResult optimize_pose_graph(const PoseGraph& graph, const PoseGraphConfig& config,
                                    const std::atomic<bool>* abort) {
  const std::size_t poses = graph.T_camera_world.size();
  CHECK(graph.fixed.empty() || graph.fixed.size() == poses);
  for (const PoseGraphEdge& edge : graph.edges) {
    CHECK(edge.from < poses && edge.to < poses && edge.from != edge.to);
  }
  for (const MeasuredDirection& direction : graph.directions) CHECK(direction.pose < poses);
  return PoseGraphOptimizer(graph, config, abort).run();
}

}  // namespace ygslam
