#include "optim/referee/ceres_referee.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace ygslam::referee {
namespace {

using PoseParameters = std::array<double, 6>;  // angle-axis, translation

PoseParameters to_parameters(const SE3& T) {
  const Vec3 omega = so3_log(T.R());
  return {omega.x(), omega.y(), omega.z(), T.t().x(), T.t().y(), T.t().z()};
}

SE3 to_pose(const PoseParameters& p) {
  return SE3(so3_exp({p[0], p[1], p[2]}), Vec3(p[3], p[4], p[5]));
}

template <class T>
std::array<T, 3> transformed(const T* pose, const T* point) {
  std::array<T, 3> p;
  ceres::AngleAxisRotatePoint(pose, point, p.data());
  for (int i = 0; i < 3; ++i) p[i] += pose[3 + i];
  return p;
}

struct PixelResidual {
  double fx, fy, cx, cy, u, v, sigma_px;
  template <class T>
  bool operator()(const T* pose, const T* point, T* r) const {
    const auto p = transformed(pose, point);
    r[0] = (fx * p[0] / p[2] + cx - u) / sigma_px;
    r[1] = (fy * p[1] / p[2] + cy - v) / sigma_px;
    return true;
  }
};

struct DepthResidual {
  double depth_m, sigma_depth_m;
  template <class T>
  bool operator()(const T* pose, const T* point, T* r) const {
    const auto p = transformed(pose, point);
    r[0] = (1.0 / p[2] - 1.0 / depth_m) / (sigma_depth_m / (depth_m * depth_m));
    return true;
  }
};

// log of a rigid motion, translation first. Written anew with Rodrigues' vector and the closed form
// of the inverse Jacobian, so that it shares nothing with what it judges.
template <class T>
void log_motion(const T* R, const T* t, T* twist) {
  T* omega = twist + 3;
  ceres::RotationMatrixToAngleAxis(R, omega);
  const T theta2 = omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2];
  T k = 1.0 / 12 + theta2 / 720.0 + theta2 * theta2 / 30240.0;
  if (theta2 > 1e-2) {
    const T theta = sqrt(theta2);
    k = 1.0 / theta2 - (1.0 + cos(theta)) / (2.0 * theta * sin(theta));
  }
  T once[3], twice[3];
  ceres::CrossProduct(omega, t, once);
  ceres::CrossProduct(omega, once, twice);
  for (int i = 0; i < 3; ++i) twist[i] = t[i] - 0.5 * once[i] + k * twice[i];
}

struct RelativePoseResidual {
  SE3 T_from_to;
  Mat6 root;  // root^T root = information

  template <class T>
  bool operator()(const T* from, const T* to, T* r) const {
    using Mat = Eigen::Matrix<T, 3, 3>;  // column-major, as Ceres' rotations
    using Vec = Eigen::Matrix<T, 3, 1>;
    Mat R_from, R_to;
    ceres::AngleAxisToRotationMatrix(from, R_from.data());
    ceres::AngleAxisToRotationMatrix(to, R_to.data());
    const Mat R_predicted = R_to * R_from.transpose();
    const Vec t_predicted = Vec(to[3], to[4], to[5]) - R_predicted * Vec(from[3], from[4], from[5]);
    const Mat R = R_predicted * T_from_to.R().cast<T>();
    const Vec t = R_predicted * T_from_to.t().cast<T>() + t_predicted;
    Eigen::Matrix<T, 6, 1> twist;
    log_motion(R.data(), t.data(), twist.data());
    Eigen::Map<Eigen::Matrix<T, 6, 1>>(r, 6) = root.cast<T>() * twist;
    return true;
  }
};

struct DirectionResidual {
  Vec3 world, camera;
  Mat3 root;  // root^T root = information

  template <class T>
  bool operator()(const T* pose, T* r) const {
    const Eigen::Matrix<T, 3, 1> seen_from = world.cast<T>();
    Eigen::Matrix<T, 3, 1> turned;
    ceres::AngleAxisRotatePoint(pose, seen_from.data(), turned.data());
    Eigen::Map<Eigen::Matrix<T, 3, 1>>(r, 3) = root.cast<T>() * (turned - camera.cast<T>());
    return true;
  }
};

void add_directions(ceres::Problem& problem, const std::vector<MeasuredDirection>& directions,
                    std::vector<PoseParameters>& poses) {
  for (const MeasuredDirection& direction : directions) {
    const Mat3 root = direction.information.llt().matrixU();
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<DirectionResidual, 3, 6>(
            new DirectionResidual{direction.direction_world, direction.direction_camera, root}),
        nullptr, poses[direction.pose].data());
  }
}

ceres::LossFunction* kernel(double chi2, double weight) {
  ceres::LossFunction* huber = std::isinf(chi2) ? nullptr : new ceres::HuberLoss(std::sqrt(chi2));
  return new ceres::ScaledLoss(huber, weight, ceres::TAKE_OWNERSHIP);
}

void add_residuals(ceres::Problem& problem, const Camera& c, const Observation& seen,
                   const Settings& settings, double* pose, double* point) {
  auto* pixel_kernel =
      std::isinf(settings.tail_dof)
          ? kernel(settings.chi2_pixel, seen.weight)
          : new ceres::ScaledLoss(new ceres::CauchyLoss(std::sqrt(settings.tail_dof)), seen.weight,
                                  ceres::TAKE_OWNERSHIP);
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<PixelResidual, 2, 6, 3>(new PixelResidual{
          c.fx(), c.fy(), c.cx(), c.cy(), seen.ideal_px.x(), seen.ideal_px.y(), seen.sigma_px}),
      pixel_kernel, pose, point);
  if (seen.depth_m <= 0) return;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DepthResidual, 1, 6, 3>(
                               new DepthResidual{seen.depth_m, seen.sigma_depth_m}),
                           kernel(settings.chi2_depth, seen.weight), pose, point);
}

void solve(ceres::Problem& problem, ceres::LinearSolverType solver, const Settings& settings,
           Solution& solution) {
  ceres::Solver::Options options;
  options.linear_solver_type = solver;
  options.max_num_iterations = settings.iterations;
  options.function_tolerance = settings.relative_decrease;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  solution.initial_cost = summary.initial_cost;
  solution.final_cost = summary.final_cost;
  solution.iterations = static_cast<int>(summary.iterations.size());
}

}  // namespace

Solution adjust_bundle(const Camera& camera, const BundleProblem& problem,
                       const Settings& settings) {
  std::vector<PoseParameters> poses;
  for (const BundlePose& pose : problem.poses) poses.push_back(to_parameters(pose.T_camera_world));
  Solution solution;
  solution.points_world = problem.points_world;
  ceres::Problem ceres_problem;
  for (const BundleObservation& o : problem.observations) {
    add_residuals(ceres_problem, camera, o.seen, settings, poses[o.pose].data(),
                  solution.points_world[o.point].data());
  }
  add_directions(ceres_problem, problem.directions, poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (problem.poses[i].fixed && ceres_problem.HasParameterBlock(poses[i].data())) {
      ceres_problem.SetParameterBlockConstant(poses[i].data());
    }
  }
  solve(ceres_problem, ceres::DENSE_SCHUR, settings, solution);
  for (const PoseParameters& pose : poses) solution.T_camera_world.push_back(to_pose(pose));
  return solution;
}

Solution solve_pose(const Camera& camera, const SE3& T_camera_world_guess,
                    const std::vector<PoseObservation>& observations, const Settings& settings) {
  PoseParameters pose = to_parameters(T_camera_world_guess);
  std::vector<Vec3> points;
  for (const PoseObservation& o : observations) points.push_back(o.p_world);
  Solution solution;
  ceres::Problem problem;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    add_residuals(problem, camera, observations[i].seen, settings, pose.data(), points[i].data());
    problem.SetParameterBlockConstant(points[i].data());
  }
  solve(problem, ceres::DENSE_QR, settings, solution);
  solution.T_camera_world = {to_pose(pose)};
  return solution;
}

Solution optimize_pose_graph(const PoseGraph& graph, const Settings& settings) {
  std::vector<PoseParameters> poses;
  for (const SE3& T : graph.T_camera_world) poses.push_back(to_parameters(T));
  ceres::Problem problem;
  for (const PoseGraphEdge& edge : graph.edges) {
    const Mat6 root = edge.information.llt().matrixU();
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RelativePoseResidual, 6, 6, 6>(
                                 new RelativePoseResidual{edge.T_to_from.inverse(), root}),
                             nullptr, poses[edge.from].data(), poses[edge.to].data());
  }
  add_directions(problem, graph.directions, poses);
  std::vector<std::uint8_t> fixed = graph.fixed;
  fixed.resize(poses.size(), 0);
  if (std::ranges::count(fixed, 1) == 0) fixed[0] = 1;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (fixed[i]) problem.SetParameterBlockConstant(poses[i].data());
  }
  Solution solution;
  solve(problem, ceres::SPARSE_NORMAL_CHOLESKY, settings, solution);
  for (const PoseParameters& pose : poses) solution.T_camera_world.push_back(to_pose(pose));
  return solution;
}

}  // namespace ygslam::referee
