#include "optim/bundle_system.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "optim/synthetic_views.hpp"

namespace ygslam {
namespace {

struct FullSystem {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

// The whole system from the plain Jacobians, poses 1.. first, then all points.
FullSystem full_system(const BundleProblem& problem, const BundleState& state,
                       const ResidualKernels& kernels) {
  const Eigen::Index poses = 6 * (static_cast<Eigen::Index>(problem.poses.size()) - 1);
  const Eigen::Index n = poses + 3 * static_cast<Eigen::Index>(problem.points_world.size());
  FullSystem full{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
  for (const BundleObservation& o : problem.observations) {
    const SE3& T = state.T_camera_world[o.pose];
    const Vec3& p_world = state.points_world[o.point];
    const Vec3 r = residual_vector(synthetic::camera(), o.seen, T * p_world);
    const double wp = o.seen.weight * kernels.pixel.weight(r.head<2>().squaredNorm());
    const double wd = o.seen.weight * kernels.depth.weight(r[2] * r[2]);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, n);
    if (o.pose > 0) {
      J.middleCols<6>(6 * (o.pose - 1)) = pose_jacobian(synthetic::camera(), o.seen, T * p_world);
    }
    J.middleCols<3>(poses + 3 * o.point) = point_jacobian(synthetic::camera(), o.seen, T, p_world);
    const Mat3 W = Vec3(wp, wp, wd).asDiagonal();
    full.H += J.transpose() * W * J;
    full.g += J.transpose() * W * r;
  }
  return full;
}

TEST(BundleSystem, EliminatingThePointsGivesTheStepOfTheWholeSystem) {
  Rng rng(1);
  synthetic::BundleWorld world = synthetic::bundle_world(5, 25, 4, {.without_depth_share = 0}, rng);
  BundleProblem& problem = world.problem;
  for (std::size_t i = 0, n = problem.observations.size(); i < n; i += 2) {
    problem.observations.push_back(problem.observations[i]);  // twice in one image
    problem.observations.back().seen.ideal_px += Vec2(1, -1);
  }
  for (BundleObservation& o : problem.observations) o.seen.weight = rng.uniform(0.2, 1);
  synthetic::perturb(problem, 0.01, 0.01, 0.02, rng);
  BundleState state;
  for (const BundlePose& pose : problem.poses) state.T_camera_world.push_back(pose.T_camera_world);
  state.points_world = problem.points_world;

  const ResidualKernels kernels = {{2.0}, {1.5}};
  constexpr double kLambda = 0.01;
  FullSystem full = full_system(problem, state, kernels);
  full.H.diagonal() *= 1 + kLambda;
  const Eigen::VectorXd step = -full.H.ldlt().solve(full.g);

  std::vector<BundleTerm> terms = sorted_terms(synthetic::camera(), problem);
  for (BundleTerm& t : terms) t.use_pixel = t.use_depth = t.weight;
  BundleSystem system(terms, {}, {}, {1, 0, 0, 0, 0});
  system.linearize(state, kernels);
  ASSERT_TRUE(system.solve(kLambda));
  BundleState moved;
  system.apply_step(state, moved);

  for (std::size_t i = 1; i < 5; ++i) {
    const Vec6 xi = (moved.T_camera_world[i] * state.T_camera_world[i].inverse()).log();
    const Vec6 expected = step.segment<6>(6 * (static_cast<Eigen::Index>(i) - 1));
    EXPECT_LT((xi - expected).norm(), 1e-8 * (1 + expected.norm()));
  }
  EXPECT_EQ(moved.T_camera_world[0].t(), state.T_camera_world[0].t());
  for (std::size_t k = 0; k < state.points_world.size(); ++k) {
    const Vec3 expected = step.segment<3>(24 + 3 * static_cast<Eigen::Index>(k));
    EXPECT_LT((moved.points_world[k] - state.points_world[k] - expected).norm(), 1e-8);
  }
}

TEST(BundleSystem, TermsAreSortedByPointThenPoseAndNoneIsLost) {
  Rng rng(2);
  synthetic::BundleWorld world = synthetic::bundle_world(6, 50, 4, {}, rng);
  auto& o = world.problem.observations;
  for (std::uint32_t i = static_cast<std::uint32_t>(o.size()) - 1; i > 0; --i) {
    std::swap(o[i], o[rng.below(i + 1)]);
  }
  const auto terms = sorted_terms(synthetic::camera(), world.problem);
  ASSERT_EQ(terms.size(), o.size());
  std::vector<int> seen(o.size(), 0);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    ++seen[terms[i].source];
    EXPECT_EQ(terms[i].point, o[terms[i].source].point);
    EXPECT_EQ(terms[i].pose, o[terms[i].source].pose);
    if (i == 0) continue;
    EXPECT_LE(std::pair(terms[i - 1].point, terms[i - 1].pose),
              std::pair(terms[i].point, terms[i].pose));
  }
  for (const int times : seen) EXPECT_EQ(times, 1);
}

TEST(BundleSystem, SolvesNothingOnceTheFlagIsSet) {
  Rng rng(3);
  const synthetic::BundleWorld world = synthetic::bundle_world(5, 40, 4, {}, rng);
  BundleState state{world.T_camera_world, world.points_world};
  auto terms = sorted_terms(synthetic::camera(), world.problem);
  for (BundleTerm& t : terms) t.use_pixel = t.use_depth = 1;
  drop_undetermined_points(terms, state.points_world.size());
  std::atomic<bool> abort = false;
  BundleSystem system(terms, {}, {}, {1, 0, 0, 0, 0}, &abort);
  system.linearize(state, {});
  EXPECT_TRUE(system.solve(1e-5));
  abort = true;
  EXPECT_FALSE(system.solve(1e-5));
}

}  // namespace
}  // namespace ygslam
