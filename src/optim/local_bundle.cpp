#include "optim/local_bundle.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "optim/bundle_system.hpp"
#include "optim/stop_flag.hpp"

namespace ygslam {
namespace {

constexpr double kFirstLambda = 1e-5;
constexpr double kLeastLambda = 1e-9;
constexpr double kLargestLambda = 1e8;

bool is_valid(const BundleProblem& problem) {
  for (const BundleObservation& o : problem.observations) {
    CHECK(o.pose < problem.poses.size() && o.point < problem.points_world.size());
  }
  for (const PoseGraphEdge& motion : problem.motions) {
    CHECK(motion.from < problem.poses.size() && motion.to < problem.poses.size() &&
          motion.from != motion.to);
  }
  for (const MeasuredDirection& direction : problem.directions)
    CHECK(direction.pose < problem.poses.size());
  return std::ranges::all_of(problem.poses,
                             [](const auto& p) { return p.T_camera_world.is_finite(); }) &&
         std::ranges::all_of(problem.points_world, [](const Vec3& p) { return p.allFinite(); }) &&
         std::ranges::all_of(problem.observations,
                             [](const auto& o) { return is_usable(o.seen); }) &&
         std::ranges::all_of(problem.motions,
                             [](const auto& motion) {
                               return motion.T_to_from.is_finite() &&
                                      motion.information.allFinite();
                             }) &&
         std::ranges::all_of(problem.directions, [](const auto& d) { return is_finite(d); });
}

std::vector<std::uint8_t> fixed_poses(const BundleProblem& problem) {
  std::vector<std::uint8_t> fixed(problem.poses.size(), 0);
  for (std::size_t i = 0; i < fixed.size(); ++i) fixed[i] = problem.poses[i].fixed ? 1 : 0;
  if (!fixed.empty() && std::ranges::count(fixed, 1) == 0) fixed[0] = 1;  // the gauge
  return fixed;
}

class BundleAdjuster {
 public:
  BundleAdjuster(const Camera& camera, const BundleProblem& problem, const BundleConfig& config,
                 const std::atomic<bool>* abort)
      : config_(config),
        abort_(abort),
        huber_{{.delta = std::sqrt(config.chi2_pixel)}, {.delta = std::sqrt(config.chi2_depth)}},
        last_(huber_),
        fixed_(fixed_poses(problem)),
        terms_(sorted_terms(camera, problem)),
        motions_(problem.motions),
        directions_(problem.directions) {
    for (const BundlePose& pose : problem.poses)
      state_.T_camera_world.push_back(pose.T_camera_world);
    state_.points_world = problem.points_world;
    trial_ = state_;
    if (config.iterations_refine > 0 && std::isfinite(config.tail_dof))
      last_.pixel = {.tail_dof = config.tail_dof};
  }

  /// @return false if the result is not to be used.
  bool run(BundleResult& result) {
    use_all();
    result.initial_cost = cost_of(state_, last_);
    if (!std::isfinite(result.initial_cost)) return false;
    best_ = state_;
    best_cost_ = result.initial_cost;
    if (!minimise(config_.iterations_robust, huber_)) return false;
    keep_best();
    if (!interrupted_) {
      drop_outliers();
      if (!minimise(config_.iterations_refine, last_)) return false;
      keep_best();
    }
    state_ = best_;
    result.final_cost = best_cost_;
    result.iterations = iterations_;
    result.interrupted = interrupted_;
    result.outlier = judge(result.outlier.size());
    result.T_camera_world = state_.T_camera_world;
    result.points_world = state_.points_world;
    return true;
  }

 private:
  [[nodiscard]] double cost_of(const BundleState& state, const ResidualKernels& kernels) const {
    return bundle_cost(terms_, state, kernels) + motion_cost(motions_, state) +
           direction_cost(directions_, state.T_camera_world);
  }

  void keep_best() {
    use_all();
    const double cost = cost_of(state_, last_);
    if (!(cost <= best_cost_)) return;
    best_ = state_;
    best_cost_ = cost;
  }

  void use_all() {
    for (BundleTerm& t : terms_) t.use_pixel = t.use_depth = t.weight;
    drop_undetermined_points(terms_, state_.points_world.size());
  }

  struct Verdict {
    bool pixel, depth;
  };

  [[nodiscard]] Verdict verdict(const BundleTerm& t) const {
    const Vec3 p_cam = state_.T_camera_world[t.pose] * state_.points_world[t.point];
    const auto r = residual_at(t.seen, p_cam.x(), p_cam.y(), p_cam.z());
    const bool pixel = r.seen > 0 && r.chi2_pixel() <= config_.gate_chi2_pixel;
    return {pixel, pixel && r.chi2_depth() <= config_.chi2_depth};
  }

  void drop_outliers() {
    for (BundleTerm& t : terms_) {
      const Verdict agrees = verdict(t);
      t.use_pixel = agrees.pixel ? t.weight : 0.0;
      t.use_depth = agrees.depth ? t.weight : 0.0;
    }
    drop_undetermined_points(terms_, state_.points_world.size());
  }

  [[nodiscard]] std::vector<std::uint8_t> judge(std::size_t observations) const {
    std::vector<std::uint8_t> outlier(observations, 0);
    for (const BundleTerm& t : terms_) outlier[t.source] = verdict(t).pixel ? 0 : 1;
    return outlier;
  }

  [[nodiscard]] bool is_aborted() {
    if (is_stopped(abort_)) interrupted_ = true;
    return interrupted_;
  }

  // Levenberg-Marquardt with Marquardt's scaling.
  // @return false if the equations were never solvable.
  bool minimise(int iterations, const ResidualKernels& kernels) {
    double cost = cost_of(state_, kernels);
    BundleSystem system(terms_, motions_, directions_, fixed_, abort_);
    if (is_aborted() || !system.has_unknowns()) return true;
    double lambda = kFirstLambda;
    bool is_linearized = false;
    bool was_solved = iterations <= 0;
    for (int i = 0; i < iterations && lambda < kLargestLambda && !is_aborted(); ++i) {
      ++iterations_;
      if (!is_linearized) system.linearize(state_, kernels);
      is_linearized = true;
      const bool solved = system.solve(lambda);
      was_solved |= solved;
      if (solved) system.apply_step(state_, trial_);
      const double trial_cost = solved ? cost_of(trial_, kernels) : HUGE_VAL;
      if (!(trial_cost <= cost)) {
        if (solved && std::abs(trial_cost - cost) < 1e-12 * cost)
          break;  // rounding: at the optimum
        lambda *= 10.0;
        continue;
      }
      const double decrease = cost - trial_cost;
      std::swap(state_, trial_);
      cost = trial_cost;
      is_linearized = false;
      lambda = std::max(0.1 * lambda, kLeastLambda);
      if (decrease <= config_.relative_decrease * cost) break;
    }
    return was_solved || interrupted_;
  }

  const BundleConfig& config_;
  const std::atomic<bool>* abort_;
  ResidualKernels huber_, last_;
  std::vector<std::uint8_t> fixed_;
  std::vector<BundleTerm> terms_;
  const std::vector<PoseGraphEdge>& motions_;
  const std::vector<MeasuredDirection>& directions_;
  BundleState state_, trial_, best_;
  double best_cost_ = 0;
  int iterations_ = 0;
  bool interrupted_ = false;
};

BundleResult unchanged(const BundleProblem& problem) {
  BundleResult result;
  for (const BundlePose& pose : problem.poses) result.T_camera_world.push_back(pose.T_camera_world);
  result.points_world = problem.points_world;
  result.outlier.assign(problem.observations.size(), 0);
  return result;
}

}  // namespace

BundleResult adjust_bundle(const Camera& camera, const BundleProblem& problem,
                           const BundleConfig& config, const std::atomic<bool>* abort) {
  BundleResult result = unchanged(problem);
  if (!is_valid(problem)) return result;
  BundleResult adjusted = result;
  if (!BundleAdjuster(camera, problem, config, abort).run(adjusted)) return result;
  adjusted.usable = true;
  return adjusted;
}

}  // namespace ygslam
