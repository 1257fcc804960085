#include "inertial/inertial_window.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <utility>

#include "core/chi_square.hpp"

namespace ygslam {
namespace {

constexpr double kSmallStep = 1e-5;  // rad, m, m/s

// Of a seen pose: 1 as far as noise explains it, beyond that inverse to chi-square, as the tail of
// Cauchy's weight is.
double weight(double chi_square) {
  return chi_square <= kMostChiSquare6 ? 1 : kMostChiSquare6 / chi_square;
}

}  // namespace

void InertialWindow::begin(Node first, const StateMatrix& information) {
  prior_ = {first.state, information, StateVector::Zero()};
  nodes_.clear();
  nodes_.push_back(std::move(first));
}

void InertialWindow::add_prior(Block& first) const {
  const StateVector moved = change_between(prior_->at, nodes_.front().state);
  const StateMatrix by_first = change_jacobian(prior_->at, nodes_.front().state);
  first.diagonal += by_first.transpose() * prior_->information * by_first;
  first.gradient += by_first.transpose() * (prior_->gradient + prior_->information * moved);
}

void InertialWindow::add_seen(const Node& node, Block& block) const {
  if (!node.seen) return;
  const auto [residual, by_pose] = linear(*node.seen, node.state);
  const Mat6 information = node.seen->covariance.inverse();
  const double w = weight(residual.dot(information * residual));
  const Mat6 weighted = w * by_pose.transpose() * information;
  block.diagonal.topLeftCorner<6, 6>() += weighted * by_pose;
  block.gradient.head<6>() += weighted * residual;
}

void InertialWindow::add_tie(std::size_t after, Block& before_block, Block& after_block) const {
  const MotionFactor& motion = *nodes_[after].motion;
  const auto [residual, by_before, by_after] =
      motion.linear(nodes_[after - 1].state, nodes_[after].state, gravity_);
  const StateMatrix before_weighted = by_before.transpose() * motion.information();
  const StateMatrix after_weighted = by_after.transpose() * motion.information();
  before_block.diagonal += before_weighted * by_before;
  before_block.to_next += before_weighted * by_after;
  before_block.gradient += before_weighted * residual;
  after_block.diagonal += after_weighted * by_after;
  after_block.gradient += after_weighted * residual;
  add_wheels(after, before_block, after_block);
}

void InertialWindow::add_wheels(std::size_t after, Block& before_block, Block& after_block) const {
  const auto& wheels = nodes_[after].wheels;
  if (!wheels) return;
  const auto [residual, by_before, by_after] =
      linear(*wheels, nodes_[after - 1].state, nodes_[after].state);
  const Mat6 information = wheels->covariance.inverse();
  const Mat6 before_weighted = by_before.transpose() * information;
  const Mat6 after_weighted = by_after.transpose() * information;
  before_block.diagonal.topLeftCorner<6, 6>() += before_weighted * by_before;
  before_block.to_next.topLeftCorner<6, 6>() += before_weighted * by_after;
  before_block.gradient.head<6>() += before_weighted * residual;
  after_block.diagonal.topLeftCorner<6, 6>() += after_weighted * by_after;
  after_block.gradient.head<6>() += after_weighted * residual;
}

std::vector<InertialWindow::Block> InertialWindow::linearised() const {
  std::vector<Block> blocks(nodes_.size());
  add_prior(blocks.front());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    add_seen(nodes_[i], blocks[i]);
    if (i > 0) add_tie(i, blocks[i - 1], blocks[i]);
  }
  return blocks;
}

/// @return the change of the newest node.
std::optional<StateVector> InertialWindow::step() {
  std::vector<Block> blocks = linearised();
  std::vector<Eigen::LLT<StateMatrix>> roots;
  roots.reserve(blocks.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    roots.emplace_back(blocks[i].diagonal);
    if (roots.back().info() != Eigen::Success) return std::nullopt;
    if (i + 1 == blocks.size()) break;
    blocks[i + 1].diagonal -= blocks[i].to_next.transpose() * roots[i].solve(blocks[i].to_next);
    blocks[i + 1].gradient -= blocks[i].to_next.transpose() * roots[i].solve(blocks[i].gradient);
  }
  covariance_ = roots.back().solve(StateMatrix::Identity());
  const StateVector newest = -roots.back().solve(blocks.back().gradient);
  if (!newest.allFinite()) return std::nullopt;
  StateVector change = newest;
  for (std::size_t i = blocks.size(); i-- > 0;) {
    if (i + 1 < blocks.size())
      change = -roots[i].solve(blocks[i].gradient + blocks[i].to_next * change);
    nodes_[i].state = changed(nodes_[i].state, change);
  }
  return newest;
}

bool InertialWindow::solve(int most_steps) {
  for (int i = 0; i < most_steps; ++i) {
    const auto change = step();
    if (!change) return false;
    if (change->head<9>().norm() < kSmallStep) return true;
  }
  return true;
}

/// What all that is tied to the first node says of the second (Schur's complement).
void InertialWindow::marginalise_first() {
  Block first, second;
  add_prior(first);
  add_seen(nodes_[0], first);
  add_tie(1, first, second);
  const Eigen::LLT<StateMatrix> root(first.diagonal);
  const StateMatrix& tie = first.to_next;
  const StateMatrix information = second.diagonal - tie.transpose() * root.solve(tie);
  prior_ = {nodes_[1].state, 0.5 * (information + information.transpose()),
            second.gradient - tie.transpose() * root.solve(first.gradient)};
  nodes_.pop_front();
  nodes_.front().motion.reset();
}

void InertialWindow::marginalise_to(std::size_t count) {
  while (nodes_.size() > count) marginalise_first();
}

void InertialWindow::place_newest(const SeenPose& pose) {
  using namespace state_part;
  const auto [before, covariance] = newest();
  const Mat3 R_imu_before = before.T_odom_imu.R().transpose();
  const Mat3& R_after_imu = pose.T_odom_imu.R();
  const Vec3 g_imu = R_imu_before * gravity_.at(before.tilt);
  const Vec3 v_imu = R_imu_before * before.velocity_odom_mps;
  const Eigen::Matrix<double, 3, 2> by_tilt_before =
      R_imu_before * gravity_.derivative(before.tilt);
  gravity_ = TiltedGravity(R_after_imu * g_imu);
  InertialState after = before;
  after.T_odom_imu = pose.T_odom_imu;
  after.velocity_odom_mps = R_after_imu * v_imu;
  after.tilt.setZero();

  StateMatrix J = StateMatrix::Zero();
  J.block<3, 3>(kVelocity, kRotation) = R_after_imu * skew(v_imu);
  J.block<3, 3>(kVelocity, kVelocity) = R_after_imu * R_imu_before;
  J.block<6, 6>(kGyroBias, kGyroBias).setIdentity();
  const Eigen::Matrix<double, 2, 3> to_tilt = gravity_.tilt_from_gravity(after.tilt) * R_after_imu;
  J.block<2, 3>(kTilt, kRotation) = to_tilt * skew(g_imu);
  J.block<2, 2>(kTilt, kTilt) = to_tilt * by_tilt_before;
  StateMatrix placed = J * covariance * J.transpose();
  // An error of the pose turns velocity and gravity along: which way is down is known no worse.
  Eigen::Matrix<double, kStateSize, 6> by_pose = Eigen::Matrix<double, kStateSize, 6>::Zero();
  by_pose.block<3, 3>(kRotation, 3).setIdentity();
  by_pose.block<3, 3>(kPosition, 0) = R_after_imu;
  by_pose.block<3, 3>(kVelocity, 3) = -R_after_imu * skew(v_imu);
  by_pose.block<2, 3>(kTilt, 3) = -to_tilt * skew(g_imu);
  placed += by_pose * pose.covariance * by_pose.transpose();
  begin({after, std::nullopt, std::nullopt}, placed.inverse());
  covariance_ = placed;
}

InertialWindow::Fit InertialWindow::fit() const {
  Fit fit;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    if (node.seen) {
      const Vec6 residual = linear(*node.seen, node.state).residual;
      fit.chi_square += residual.dot(node.seen->covariance.inverse() * residual);
      fit.freedom += 6;
    }
    if (i == 0) continue;
    const StateVector residual =
        node.motion->linear(nodes_[i - 1].state, node.state, gravity_).residual;
    fit.chi_square += residual.dot(node.motion->information() * residual);
  }
  fit.freedom -= kStateSize;  // each tie determines the state after it
  return fit;
}

}  // namespace ygslam
