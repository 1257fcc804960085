#include "optim/pose_graph_system.hpp"

#include <algorithm>
#include <numeric>

#include "core/check.hpp"

namespace ygslam {
namespace {

// Keeps the damped equations positive definite where an edge of weight 0 leaves a pose loose.
constexpr double kLeastPoseDiagonal = 1e-6;

// The parts of a graph that hang together (union-find; the lowest index stands for its part).
class Parts {
 public:
  explicit Parts(std::size_t poses) : parent_(poses) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  [[nodiscard]] std::uint32_t of(std::uint32_t pose) {
    while (parent_[pose] != pose) pose = parent_[pose] = parent_[parent_[pose]];
    return pose;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = of(a), b = of(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// The fixed poses, and one of each part that has none.
std::vector<std::uint8_t> held_poses(const PoseGraph& graph) {
  const auto poses = static_cast<std::uint32_t>(graph.T_camera_world.size());
  std::vector<std::uint8_t> held = graph.fixed;
  held.resize(poses, 0);
  Parts parts(poses);
  for (const PoseGraphEdge& edge : graph.edges) parts.join(edge.from, edge.to);
  std::vector<std::uint8_t> part_is_held(poses, 0);
  for (std::uint32_t i = 0; i < poses; ++i) part_is_held[parts.of(i)] |= held[i];
  for (std::uint32_t i = 0; i < poses; ++i) {
    if (parts.of(i) == i && !part_is_held[i]) held[i] = 1;
  }
  return held;
}

}  // namespace

Vec6 pose_graph_residual(const PoseGraphEdge& edge, const SE3& T_from_world,
                         const SE3& T_to_world) {
  return (T_to_world * T_from_world.inverse() * edge.T_to_from.inverse()).log();
}

// exp(xi) from the left of `to` stands at the left of the whole product. That of `from` comes out
// of its inverse with the sign changed and is carried to the left by the adjoint.
PoseGraphJacobians pose_graph_jacobians(const Vec6& e, const SE3& T_from_world,
                                        const SE3& T_to_world) {
  const Mat6 to = se3_left_jacobian_inverse(e);
  return {-to * (T_to_world * T_from_world.inverse()).adjoint(), to};
}

PoseGraphSystem::PoseGraphSystem(const PoseGraph& graph) : graph_(graph) {
  choose_unknowns();
  const auto slots = pose_of_slot_.size();
  equations_.reset(static_cast<int>(slots));
  for (const PoseGraphEdge& edge : graph.edges) {
    const std::int32_t a = slot_of_pose_[edge.from], b = slot_of_pose_[edge.to];
    block_of_edge_.push_back(kNoBlock);
    if (a < 0 || b < 0) continue;
    block_of_edge_.back() = equations_.add_pair(static_cast<std::uint32_t>(std::min(a, b)),
                                                static_cast<std::uint32_t>(std::max(a, b)));
  }
  equations_.freeze();
  linearized_.assign(equations_.blocks(), PoseBlock::Zero());
  gradient_.setZero(6 * static_cast<Eigen::Index>(slots));
  step_ = gradient_;
}

void PoseGraphSystem::choose_unknowns() {
  const std::vector<std::uint8_t> held = held_poses(graph_);
  slot_of_pose_.assign(held.size(), -1);
  for (std::uint32_t i = 0; i < held.size(); ++i) {
    if (held[i]) continue;
    slot_of_pose_[i] = static_cast<std::int32_t>(pose_of_slot_.size());
    pose_of_slot_.push_back(i);
  }
}

void PoseGraphSystem::chi2(std::span<const SE3> T_camera_world, std::vector<double>& chi2) const {
  chi2.resize(graph_.edges.size());
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    const PoseGraphEdge& edge = graph_.edges[i];
    const Vec6 e = pose_graph_residual(edge, T_camera_world[edge.from], T_camera_world[edge.to]);
    chi2[i] = e.dot(edge.information * e);
  }
}

void PoseGraphSystem::linearize(std::span<const SE3> T_camera_world,
                                std::span<const double> edge_weight) {
  for (PoseBlock& block : linearized_) block.setZero();
  gradient_.setZero();
  for (std::size_t i = 0; i < graph_.edges.size(); ++i) {
    if (edge_weight[i] == 0) continue;
    const PoseGraphEdge& edge = graph_.edges[i];
    const SE3& T_from = T_camera_world[edge.from];
    const SE3& T_to = T_camera_world[edge.to];
    const Vec6 e = pose_graph_residual(edge, T_from, T_to);
    const PoseGraphJacobians J = pose_graph_jacobians(e, T_from, T_to);
    const Mat6 WJ_to = edge_weight[i] * edge.information * J.to;
    const Mat6 WJ_from = edge_weight[i] * edge.information * J.from;
    const std::int32_t from = slot_of_pose_[edge.from], to = slot_of_pose_[edge.to];
    if (from >= 0) {
      linearized_[from].topRows<6>().noalias() += J.from.transpose() * WJ_from;
      gradient_.segment<6>(6 * from).noalias() += WJ_from.transpose() * e;
    }
    if (to >= 0) {
      linearized_[to].topRows<6>().noalias() += J.to.transpose() * WJ_to;
      gradient_.segment<6>(6 * to).noalias() += WJ_to.transpose() * e;
    }
    if (block_of_edge_[i] == kNoBlock) continue;
    auto block = linearized_[block_of_edge_[i]].topRows<6>();  // of the upper triangle
    if (from < to) {
      block.noalias() += J.from.transpose() * WJ_to;
    } else {
      block.noalias() += J.to.transpose() * WJ_from;
    }
  }
  for (const MeasuredDirection& direction : graph_.directions) {
    const std::int32_t slot = slot_of_pose_[direction.pose];
    if (slot >= 0)
      add_direction(direction, T_camera_world[direction.pose], linearized_[slot].topRows<6>(),
                    gradient_.segment<6>(6 * slot));
  }
}

bool PoseGraphSystem::solve(double lambda, const std::atomic<bool>* abort) {
  for (std::uint32_t i = 0; i < linearized_.size(); ++i) equations_.block(i) = linearized_[i];
  for (std::uint32_t i = 0; i < pose_of_slot_.size(); ++i) {
    PoseBlock& block = equations_.diagonal(i);
    for (int k = 0; k < 6; ++k) block(k, k) += lambda * std::max(block(k, k), kLeastPoseDiagonal);
  }
  step_ = -gradient_;
  return equations_.solve(step_, abort);
}

void PoseGraphSystem::apply_step(std::span<const SE3> from, std::vector<SE3>& to) const {
  to.assign(from.begin(), from.end());
  for (std::size_t i = 0; i < pose_of_slot_.size(); ++i) {
    const Vec6 step = step_.segment<6>(6 * static_cast<Eigen::Index>(i));
    SE3& T = to[pose_of_slot_[i]];
    T = (SE3::exp(step) * T).normalized();
  }
}

}  // namespace ygslam
