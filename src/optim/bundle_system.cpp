#include "optim/bundle_system.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"
#include "optim/stop_flag.hpp"

namespace ygslam {
namespace {

constexpr int kLeastPoseResiduals = 6;
constexpr int kLeastPointResiduals = 3;
constexpr double kLeastDiagonal = 1e-6;

int residual_count(const BundleTerm& t) {
  return (t.use_pixel > 0 ? 2 : 0) + (t.use_depth > 0 && t.seen.scale_depth > 0 ? 1 : 0);
}

bool in_use(const BundleTerm& t) { return t.use_pixel > 0 || t.use_depth > 0; }

double damped(double diagonal, double lambda) {
  return diagonal + lambda * std::max(diagonal, kLeastDiagonal);
}

CameraNormal<double> normal_at(const BundleTerm& t, const Vec3& p_cam,
                               const ResidualKernels& kernels) {
  const Residual<double> r = residual_at(t.seen, p_cam.x(), p_cam.y(), p_cam.z());
  return camera_normal(r, t.use_pixel, t.use_depth, kernels);
}

// Adds P^T A P (lower triangle) and P^T b, with P = [I -K], K = [p]x: the share of rotation is
// K A and -K A K. Written out, because A has a zero and everything is symmetric.
void add_pose_terms(const CameraNormal<double>& n, const Vec3& p, Mat6& H, Vec6& g) {
  const double x = p.x(), y = p.y(), z = p.z();
  const double k00 = y * n.a02, k10 = z * n.a00 - x * n.a02, k20 = -y * n.a00;
  const double k01 = y * n.a12 - z * n.a11, k11 = -x * n.a12, k21 = x * n.a11;
  const double k02 = y * n.a22 - z * n.a12, k12 = z * n.a02 - x * n.a22;
  const double k22 = x * n.a12 - y * n.a02;
  H(0, 0) += n.a00, H(2, 0) += n.a02, H(3, 0) += k00, H(4, 0) += k10, H(5, 0) += k20;
  H(1, 1) += n.a11, H(2, 1) += n.a12, H(3, 1) += k01, H(4, 1) += k11, H(5, 1) += k21;
  H(2, 2) += n.a22, H(3, 2) += k02, H(4, 2) += k12, H(5, 2) += k22;
  H(3, 3) += y * k02 - z * k01, H(4, 3) += z * k00 - x * k02, H(5, 3) += x * k01 - y * k00;
  H(4, 4) += z * k10 - x * k12, H(5, 4) += x * k11 - y * k10;
  H(5, 5) += x * k21 - y * k20;
  g[0] += n.b0, g[1] += n.b1, g[2] += n.b2;
  g[3] += y * n.b2 - z * n.b1, g[4] += z * n.b0 - x * n.b2, g[5] += x * n.b1 - y * n.b0;
}

// Cholesky factor of a symmetric 3x3 matrix. False if not positive definite (or not finite).
bool cholesky(const Mat3& H, Mat3& L) {
  L.setZero();
  if (!(H(0, 0) > 0)) return false;
  L(0, 0) = std::sqrt(H(0, 0));
  L(1, 0) = H(1, 0) / L(0, 0);
  L(2, 0) = H(2, 0) / L(0, 0);
  const double d1 = H(1, 1) - L(1, 0) * L(1, 0);
  if (!(d1 > 0)) return false;
  L(1, 1) = std::sqrt(d1);
  L(2, 1) = (H(2, 1) - L(2, 0) * L(1, 0)) / L(1, 1);
  const double d2 = H(2, 2) - L(2, 0) * L(2, 0) - L(2, 1) * L(2, 1);
  if (!(d2 > 0)) return false;
  L(2, 2) = std::sqrt(d2);
  return std::isfinite(L(2, 2));
}

Vec3 forward(const Mat3& L, const Vec3& b) {
  const double x0 = b[0] / L(0, 0);
  const double x1 = (b[1] - L(1, 0) * x0) / L(1, 1);
  return {x0, x1, (b[2] - L(2, 0) * x0 - L(2, 1) * x1) / L(2, 2)};
}

Vec3 backward(const Mat3& L, const Vec3& b) {
  const double x2 = b[2] / L(2, 2);
  const double x1 = (b[1] - L(2, 1) * x2) / L(1, 1);
  return {(b[0] - L(1, 0) * x1 - L(2, 0) * x2) / L(0, 0), x1, x2};
}

}  // namespace

std::vector<BundleTerm> sorted_terms(const Camera& camera, const BundleProblem& problem) {
  std::vector<std::uint32_t> next(problem.points_world.size() + 1, 0);
  for (const BundleObservation& o : problem.observations) ++next[o.point + 1];
  for (std::size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
  std::vector<BundleTerm> terms(problem.observations.size());
  for (std::uint32_t i = 0; i < problem.observations.size(); ++i) {
    const BundleObservation& o = problem.observations[i];
    terms[next[o.point]++] = {whiten(camera, o.seen), o.seen.weight, 0, 0, o.pose, o.point, i};
  }
  for (auto begin = terms.begin(); begin != terms.end();) {
    auto end = begin;
    while (end != terms.end() && end->point == begin->point) ++end;
    std::sort(begin, end, [](const BundleTerm& a, const BundleTerm& b) {
      return a.pose != b.pose ? a.pose < b.pose : a.source < b.source;
    });
    begin = end;
  }
  return terms;
}

void drop_undetermined_points(std::vector<BundleTerm>& terms, std::size_t points) {
  std::vector<int> residuals(points, 0);
  for (const BundleTerm& t : terms) residuals[t.point] += residual_count(t);
  for (BundleTerm& t : terms) {
    if (residuals[t.point] < kLeastPointResiduals) t.use_pixel = t.use_depth = 0;
  }
}

double bundle_cost(const std::vector<BundleTerm>& terms, const BundleState& state,
                   const ResidualKernels& kernels) {
  double cost = 0;
  for (const BundleTerm& t : terms) {
    if (!in_use(t)) continue;
    cost += normal_at(t, state.T_camera_world[t.pose] * state.points_world[t.point], kernels).cost;
  }
  return cost;
}

double motion_cost(std::span<const PoseGraphEdge> motions, const BundleState& state) {
  double cost = 0;
  for (const PoseGraphEdge& motion : motions) {
    const Vec6 e = pose_graph_residual(motion, state.T_camera_world[motion.from],
                                       state.T_camera_world[motion.to]);
    cost += 0.5 * e.dot(motion.information * e);
  }
  return cost;
}

BundleSystem::BundleSystem(const std::vector<BundleTerm>& terms,
                           std::span<const PoseGraphEdge> motions,
                           std::span<const MeasuredDirection> directions,
                           const std::vector<std::uint8_t>& pose_is_fixed,
                           const std::atomic<bool>* abort)
    : terms_(terms), motions_(motions), directions_(directions), abort_(abort) {
  if (is_stopped(abort_)) return;
  choose_unknowns(pose_is_fixed);
  reduced_.reset(static_cast<int>(pose_of_slot_.size()));
  list_pairs();
  list_motion_pairs();
  if (is_stopped(abort_)) return;
  reduced_.freeze();
  linearized_.resize(kept_.size());
  R_transposed_.assign(pose_is_fixed.size(), Mat43::Zero());
  H_pose_.resize(pose_of_slot_.size());
  g_pose_.resize(pose_of_slot_.size());
  pose_step_.setZero(6 * static_cast<Eigen::Index>(pose_of_slot_.size()));
}

void BundleSystem::choose_unknowns(const std::vector<std::uint8_t>& pose_is_fixed) {
  std::vector<int> residuals(pose_is_fixed.size(), 0);
  for (const BundleTerm& t : terms_) residuals[t.pose] += residual_count(t);
  for (const PoseGraphEdge& motion : motions_) {
    residuals[motion.from] += 6;
    residuals[motion.to] += 6;
  }
  slot_of_pose_.assign(pose_is_fixed.size(), -1);
  for (std::uint32_t i = 0; i < pose_is_fixed.size(); ++i) {
    if (pose_is_fixed[i] || residuals[i] < kLeastPoseResiduals) continue;
    slot_of_pose_[i] = static_cast<std::int32_t>(pose_of_slot_.size());
    pose_of_slot_.push_back(i);
  }
  for (std::uint32_t i = 0; i < terms_.size(); ++i) {
    const BundleTerm& t = terms_[i];
    if (!in_use(t)) continue;
    if (points_.empty() || points_.back().index != t.point) {
      points_.push_back({});
      points_.back().index = t.point;
      points_.back().begin = static_cast<std::uint32_t>(kept_.size());
    }
    kept_.push_back({i, t.pose, slot_of_pose_[t.pose]});
    points_.back().end = static_cast<std::uint32_t>(kept_.size());
  }
}

void BundleSystem::list_pairs() {
  std::size_t longest = 0;
  for (Point& point : points_) {
    if (is_stopped(abort_)) return;
    point.pairs = static_cast<std::uint32_t>(pair_block_.size());
    longest = std::max<std::size_t>(longest, point.end - point.begin);
    for (std::uint32_t a = point.begin; a < point.end; ++a) {
      if (kept_[a].slot < 0) continue;
      for (std::uint32_t b = a; b < point.end; ++b) {
        if (kept_[b].slot < 0) continue;
        pair_block_.push_back(reduced_.add_pair(static_cast<std::uint32_t>(kept_[a].slot),
                                                static_cast<std::uint32_t>(kept_[b].slot)));
      }
    }
  }
  eliminated_.assign(longest, Elimination::Zero());
}

void BundleSystem::list_motion_pairs() {
  for (const PoseGraphEdge& motion : motions_) {
    const std::int32_t a = slot_of_pose_[motion.from], b = slot_of_pose_[motion.to];
    coupling_of_motion_.push_back(-1);
    if (a < 0 || b < 0) continue;
    coupling_of_motion_.back() = static_cast<std::int32_t>(couplings_.size());
    couplings_.push_back({reduced_.add_pair(static_cast<std::uint32_t>(std::min(a, b)),
                                            static_cast<std::uint32_t>(std::max(a, b)))});
  }
}

void BundleSystem::linearize_motions(const BundleState& state) {
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const PoseGraphEdge& motion = motions_[i];
    const SE3& T_from = state.T_camera_world[motion.from];
    const SE3& T_to = state.T_camera_world[motion.to];
    const Vec6 e = pose_graph_residual(motion, T_from, T_to);
    const PoseGraphJacobians J = pose_graph_jacobians(e, T_from, T_to);
    const Mat6 WJ_from = motion.information * J.from, WJ_to = motion.information * J.to;
    const std::int32_t from = slot_of_pose_[motion.from], to = slot_of_pose_[motion.to];
    if (from >= 0) {
      H_pose_[from].noalias() += J.from.transpose() * WJ_from;
      g_pose_[from].noalias() += WJ_from.transpose() * e;
    }
    if (to >= 0) {
      H_pose_[to].noalias() += J.to.transpose() * WJ_to;
      g_pose_[to].noalias() += WJ_to.transpose() * e;
    }
    if (coupling_of_motion_[i] < 0) continue;
    Mat6& H = couplings_[coupling_of_motion_[i]].H;
    if (from < to) {
      H.noalias() = J.from.transpose() * WJ_to;
    } else {
      H.noalias() = J.to.transpose() * WJ_from;
    }
  }
}

void BundleSystem::linearize_directions(const BundleState& state) {
  for (const MeasuredDirection& direction : directions_) {
    const std::int32_t slot = slot_of_pose_[direction.pose];
    if (slot >= 0)
      add_direction(direction, state.T_camera_world[direction.pose], H_pose_[slot], g_pose_[slot]);
  }
}

void BundleSystem::linearize(const BundleState& state, const ResidualKernels& kernels) {
  std::fill(H_pose_.begin(), H_pose_.end(), Mat6::Zero());
  std::fill(g_pose_.begin(), g_pose_.end(), Vec6::Zero());
  for (std::size_t i = 0; i < R_transposed_.size(); ++i) {
    R_transposed_[i].topRows<3>() = state.T_camera_world[i].R().transpose();
  }
  for (Point& point : points_) {
    if (is_stopped(abort_)) return;
    point.H.setZero();
    point.g.setZero();
    const Vec3& p_world = state.points_world[point.index];
    for (std::uint32_t k = point.begin; k < point.end; ++k) {
      const SE3& T = state.T_camera_world[kept_[k].pose];
      const Vec3 p_cam = T * p_world;
      const auto n = normal_at(terms_[kept_[k].term], p_cam, kernels);
      Mat43 A;
      A << n.a00, 0, n.a02, 0, n.a11, n.a12, n.a02, n.a12, n.a22, 0, 0, 0;
      Linearized& l = linearized_[k];
      l.AR.noalias() = A.lazyProduct(T.R());
      l.p_cam = p_cam;
      point.H.noalias() += R_transposed_[kept_[k].pose].lazyProduct(l.AR.topRows<3>());
      point.g.noalias() += T.R().transpose() * Vec3(n.b0, n.b1, n.b2);
      const std::int32_t slot = kept_[k].slot;
      if (slot >= 0) add_pose_terms(n, p_cam, H_pose_[slot], g_pose_[slot]);
    }
  }
  linearize_motions(state);
  linearize_directions(state);
}

void BundleSystem::start_reduced(double lambda) {
  reduced_.set_zero();
  for (std::uint32_t i = 0; i < pose_of_slot_.size(); ++i) {
    PoseBlock& block = reduced_.diagonal(i);
    block.topRows<6>() = H_pose_[i].selfadjointView<Eigen::Lower>();
    for (int k = 0; k < 6; ++k) block(k, k) = damped(block(k, k), lambda);
    pose_step_.segment<6>(6 * i) = -g_pose_[i];
  }
  for (const Coupling& coupling : couplings_)
    reduced_.block(coupling.block).topRows<6>() += coupling.H;
}

bool BundleSystem::eliminate(Point& point, double lambda) {
  Mat3 H = point.H.topRows<3>();
  for (int i = 0; i < 3; ++i) H(i, i) = damped(H(i, i), lambda);
  if (!cholesky(H, point.L)) return false;
  const Mat3& L = point.L;
  point.Lg = forward(L, point.g);
  const double i0 = 1 / L(0, 0), i1 = 1 / L(1, 1), i2 = 1 / L(2, 2);
  for (std::uint32_t a = point.begin; a < point.end; ++a) {
    if (kept_[a].slot < 0) continue;
    const Linearized& l = linearized_[a];
    Elimination& Y = eliminated_[a - point.begin];
    Y.col(0).head<4>() = l.AR.col(0) * i0;
    Y.col(1).head<4>() = (l.AR.col(1) - L(1, 0) * Y.col(0).head<4>()) * i1;
    Y.col(2).head<4>() =
        (l.AR.col(2) - L(2, 0) * Y.col(0).head<4>() - L(2, 1) * Y.col(1).head<4>()) * i2;
    for (int c = 0; c < 3; ++c) {
      Y.col(c).segment<3>(3) = l.p_cam.cross(Vec3(Y.col(c).head<3>()));
    }
    pose_step_.segment<6>(6 * kept_[a].slot).noalias() += Y.topRows<6>().lazyProduct(point.Lg);
  }
  eliminate_pairs(point);
  return true;
}

void BundleSystem::eliminate_pairs(const Point& point) {
  std::uint32_t pair = point.pairs;
  for (std::uint32_t a = point.begin; a < point.end; ++a) {
    if (kept_[a].slot < 0) continue;
    const Elimination& Ya = eliminated_[a - point.begin];
    for (std::uint32_t b = a; b < point.end; ++b) {
      if (kept_[b].slot < 0) continue;
      const Elimination& Yb = eliminated_[b - point.begin];
      PoseBlock& block = reduced_.block(pair_block_[pair++]);
      block.noalias() -= Ya.lazyProduct(Yb.topRows<6>().transpose());
      // The same point twice in one image: both orders fall on the diagonal block.
      if (a != b && kept_[a].slot == kept_[b].slot) {
        block.noalias() -= Yb.lazyProduct(Ya.topRows<6>().transpose());
      }
    }
  }
}

void BundleSystem::back_substitute() {
  for (Point& point : points_) {
    Vec3 coupling = Vec3::Zero();  // sum of H_point_pose * pose step
    for (std::uint32_t k = point.begin; k < point.end; ++k) {
      const std::int32_t slot = kept_[k].slot;
      if (slot < 0) continue;
      const Vec3 rho = pose_step_.segment<3>(6 * slot);
      const Vec3 omega = pose_step_.segment<3>(6 * slot + 3);
      const Vec3 moved = rho + omega.cross(linearized_[k].p_cam);
      coupling.noalias() += linearized_[k].AR.topRows<3>().transpose() * moved;
    }
    point.step = -backward(point.L, point.Lg + forward(point.L, coupling));
  }
}

bool BundleSystem::solve(double lambda) {
  start_reduced(lambda);
  for (Point& point : points_) {
    if (is_stopped(abort_) || !eliminate(point, lambda)) return false;
  }
  if (reduced_.poses() > 0 && !reduced_.solve(pose_step_, abort_)) return false;
  back_substitute();
  return true;
}

void BundleSystem::apply_step(const BundleState& from, BundleState& to) const {
  to.T_camera_world = from.T_camera_world;
  to.points_world = from.points_world;
  for (std::size_t i = 0; i < pose_of_slot_.size(); ++i) {
    const Vec6 step = pose_step_.segment<6>(6 * static_cast<Eigen::Index>(i));
    SE3& T = to.T_camera_world[pose_of_slot_[i]];
    T = (SE3::exp(step) * T).normalized();
  }
  for (const Point& point : points_) to.points_world[point.index] += point.step;
}

}  // namespace ygslam
