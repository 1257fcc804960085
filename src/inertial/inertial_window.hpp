// The newest states of an IMU as one least-squares problem: each tied to the one before by what the
// IMU measured, and to vision by the pose of its frame. Those that leave the window stay as what is
// known of the oldest in it (a marginalised prior), so that gravity and biases grow more certain
// with time. States follow each other, so the normal equations are block tridiagonal: one pass
// there, one back.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "inertial/inertial_state.hpp"

namespace ygslam {

class InertialWindow {
 public:
  struct Node {
    InertialState state;
    std::optional<MotionFactor> motion;  ///< since the node before; the first has none
    std::optional<SeenPose> seen;
    std::optional<WheelTie> wheels{};  ///< since the node before
  };

  explicit InertialWindow(const TiltedGravity& gravity) : gravity_(gravity) {}

  /// What is known beforehand of the first node's state, as it is given.
  void begin(Node first, const StateMatrix& information);
  void add(Node node) { nodes_.push_back(std::move(node)); }
  /// Gauss-Newton steps, until they are small. Seen poses that fit badly count less.
  /// @return false where numbers ran out of hand: the window is of no use any more.
  [[nodiscard]] bool solve(int most_steps);
  /// Keeps the newest `count` nodes.
  void marginalise_to(std::size_t count);
  /// odom is from now on where the newest pose is this one: what is known in the IMU's own frame,
  /// gravity and velocity, goes along. All other nodes are left.
  void place_newest(const SeenPose& pose);

  [[nodiscard]] const std::deque<Node>& nodes() const { return nodes_; }
  [[nodiscard]] const TiltedGravity& gravity() const { return gravity_; }
  /// After solve().
  [[nodiscard]] UncertainState newest() const { return {nodes_.back().state, covariance_}; }
  /// Squared errors of the seen poses and of the IMU in units of their variance, and how many there
  /// are beyond the unknowns.
  struct Fit {
    double chi_square = 0;
    int freedom = 0;
  };
  [[nodiscard]] Fit fit() const;

 private:
  struct Prior {
    InertialState at;
    StateMatrix information;
    StateVector gradient;  // at `at`
  };
  /// Normal equations of one node and of its tie to the next one.
  struct Block {
    StateMatrix diagonal = StateMatrix::Zero(), to_next = StateMatrix::Zero();
    StateVector gradient = StateVector::Zero();
  };
  void add_prior(Block& first) const;
  void add_seen(const Node& node, Block& block) const;
  void add_tie(std::size_t after, Block& before_block, Block& after_block) const;
  void add_wheels(std::size_t after, Block& before_block, Block& after_block) const;
  [[nodiscard]] std::vector<Block> linearised() const;
  [[nodiscard]] std::optional<StateVector> step();
  void marginalise_first();

  TiltedGravity gravity_;
  std::deque<Node> nodes_;
  std::optional<Prior> prior_;
  StateMatrix covariance_ = StateMatrix::Identity();  // of the newest
};

}  // namespace ygslam
