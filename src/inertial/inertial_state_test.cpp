#include "inertial/inertial_state.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "geometry/properties_testing.hpp"
#include "inertial/inertial_test_world.hpp"

namespace ygslam {
namespace {

InertialState any_state() {
  using properties::vector;
  return {{0},
          properties::motion(3, 2),
          vector(2),
          {vector(0.05), vector(0.3)},
          Vec2(properties::real(-0.2, 0.2), properties::real(-0.2, 0.2))};
}

StateVector small_change(double size) {
  StateVector change;
  for (int i = 0; i < kStateSize; ++i) change[i] = properties::real(-size, size);
  return change;
}

MotionFactor any_motion(const ImuBias& assumed) {
  Preintegration measured(assumed);
  for (int i = 0; i < 20; ++i)
    measured.add(properties::vector(2), properties::vector(12), 0.005, {1e-3, 1e-2});
  return {measured, {1e-4, 1e-3, 1e-4}};
}

// Of a tie by wheels, by rotation and position of both states.
RC_GTEST_PROP(WheelTieProperties, JacobiansAreThoseOfDifferences, ()) {
  const InertialState before = any_state();
  InertialState after = before;
  after.T_odom_imu = before.T_odom_imu * properties::motion(0.3, 0.2);
  const WheelTie tie{
      before.T_odom_imu.inverse() * after.T_odom_imu * properties::motion(0.02, 0.02),
      Mat6::Identity()};
  const WheelLinear analytic = linear(tie, before, after);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const StateVector step = kStep * StateVector::Unit(i);
    const Vec6 by_before = (linear(tie, changed(before, step), after).residual -
                            linear(tie, changed(before, -step), after).residual) /
                           (2 * kStep);
    const Vec6 by_after = (linear(tie, before, changed(after, step)).residual -
                           linear(tie, before, changed(after, -step)).residual) /
                          (2 * kStep);
    RC_ASSERT((by_before - analytic.by_before.col(i)).norm() < 1e-5);
    RC_ASSERT((by_after - analytic.by_after.col(i)).norm() < 1e-5);
  }
}

// Derivative of f at 0, one column for each part of a state.
template <typename Function>
auto numeric_jacobian(const Function& f) {
  constexpr double kStep = 1e-5;
  using Value = decltype(f(StateVector()));
  Eigen::Matrix<double, Value::RowsAtCompileTime, kStateSize> J;
  for (int i = 0; i < kStateSize; ++i) {
    const StateVector step = kStep * StateVector::Unit(i);
    J.col(i) = (f(step) - f(-step)) / (2 * kStep);
  }
  return J;
}

RC_GTEST_PROP(InertialStateProperties, ChangesAreUndone, ()) {
  const InertialState state = any_state();
  const StateVector change = small_change(0.5);
  RC_ASSERT((change_between(state, changed(state, change)) - change).norm() < 1e-9);
}

RC_GTEST_PROP(InertialStateProperties, ChangeJacobianMatchesFiniteDifferences, ()) {
  const InertialState from = any_state(), to = changed(from, small_change(0.5));
  const auto J =
      numeric_jacobian([&](const StateVector& d) { return change_between(from, changed(to, d)); });
  RC_ASSERT((J - change_jacobian(from, to)).norm() < 1e-6);
}

RC_GTEST_PROP(GravityProperties, HasItsSizeAndDerivative, ()) {
  const TiltedGravity gravity(properties::direction());
  const Vec2 tilt(properties::real(-0.5, 0.5), properties::real(-0.5, 0.5));
  RC_ASSERT(std::abs(gravity.at(tilt).norm() - kStandardGravity_mps2) < 1e-9);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 2; ++i) {
    const Vec2 step = kStep * Vec2::Unit(i);
    const Vec3 numeric = (gravity.at(tilt + step) - gravity.at(tilt - step)) / (2 * kStep);
    RC_ASSERT((numeric - gravity.derivative(tilt).col(i)).norm() < 1e-6);
  }
  const Vec3 g = gravity.at(tilt), turned = so3_exp(properties::vector(1e-5)) * g;
  const Vec2 change = gravity.tilt_from_gravity(tilt) * (turned - g);
  RC_ASSERT((gravity.at(tilt + change) - turned).norm() < 1e-7);
}

RC_GTEST_PROP(MotionFactorProperties, JacobiansMatchFiniteDifferences, ()) {
  const TiltedGravity gravity(properties::direction());
  const InertialState before = any_state();
  const MotionFactor motion = any_motion({properties::vector(0.05), properties::vector(0.3)});
  const InertialState after = changed(motion.after(before, {1}, gravity), small_change(0.3));
  const auto [residual, by_before, by_after] = motion.linear(before, after, gravity);
  const auto numeric_before = numeric_jacobian([&](const StateVector& d) {
    return motion.linear(changed(before, d), after, gravity).residual;
  });
  const auto numeric_after = numeric_jacobian([&](const StateVector& d) {
    return motion.linear(before, changed(after, d), gravity).residual;
  });
  RC_ASSERT((by_before - numeric_before).norm() < 1e-5);
  RC_ASSERT((by_after - numeric_after).norm() < 1e-6);
}

RC_GTEST_PROP(MotionFactorProperties, TheStateItLeadsToAgreesWithIt, ()) {
  const TiltedGravity gravity(properties::direction());
  const InertialState before = any_state();
  const MotionFactor motion = any_motion(before.bias);
  const InertialState after = motion.after(before, {1}, gravity);
  RC_ASSERT(motion.linear(before, after, gravity).residual.norm() < 1e-9);
}

/// Odom turned by so much, about the IMU's axes, and was moved: gravity and velocity turn along.
InertialState in_drifted_odom(const InertialState& state, const TiltedGravity& gravity,
                              const Vec3& turn_imu, const Vec3& way_odom) {
  const Mat3& R = state.T_odom_imu.R();
  const Mat3 R_drifted = R * so3_exp(turn_imu);
  InertialState drifted = state;
  drifted.T_odom_imu = {R_drifted, state.T_odom_imu.t() + way_odom};
  drifted.velocity_odom_mps = R_drifted * R.transpose() * state.velocity_odom_mps;
  const Vec3 g = gravity.at(state.tilt);
  drifted.tilt += gravity.tilt_from_gravity(state.tilt) * (R_drifted * R.transpose() * g - g);
  return drifted;
}

// As finite differences of the factor's residual say.
RC_GTEST_PROP(MotionFactorProperties, DriftOfOdomTurnsVelocityAndGravityAlong, ()) {
  const TiltedGravity gravity(properties::direction());
  const InertialState before = any_state();
  MotionFactor motion = any_motion(before.bias);
  const InertialState after = motion.after(before, {1}, gravity);
  constexpr OdomDrift kDrift{0.3, 0.2};
  constexpr double kStep = 1e-6;
  StateMatrix expected = motion.covariance();
  for (int i = 0; i < 3; ++i) {
    const auto residual_by = [&](const Vec3& turn, const Vec3& way) -> StateVector {
      const InertialState drifted = in_drifted_odom(after, gravity, turn, way);
      return motion.linear(before, drifted, gravity).residual / kStep;
    };
    const StateVector by_turn = residual_by(kStep * Vec3::Unit(i), Vec3::Zero());
    const StateVector by_way = residual_by(Vec3::Zero(), kStep * Vec3::Unit(i));
    expected += kDrift.rotation_rad2 * by_turn * by_turn.transpose();
    expected += kDrift.position_m2 * by_way * by_way.transpose();
  }
  motion.add_drift(kDrift, before, after, gravity);
  RC_ASSERT((motion.covariance() - expected).norm() < 1e-3 * expected.norm());
  const StateMatrix one = motion.information() * motion.covariance();
  RC_ASSERT((one - StateMatrix::Identity()).norm() < 1e-3);
}

RC_GTEST_PROP(SeenPoseProperties, JacobianMatchesFiniteDifferences, ()) {
  const InertialState state = any_state();
  const SeenPose seen{changed(state, small_change(0.5)).T_odom_imu, Mat6::Identity()};
  const auto numeric = numeric_jacobian(
      [&](const StateVector& d) { return linear(seen, changed(state, d)).residual; });
  RC_ASSERT((numeric.leftCols<6>() - linear(seen, state).by_pose).norm() < 1e-6);
  RC_ASSERT(numeric.rightCols<11>().norm() == 0);
}

// Where a state goes and how uncertain it becomes, against many drawn ones.
TEST(UncertainState, SpreadsAsManyRunsDo) {
  const TiltedGravity gravity(Vec3(0.1, -0.2, -1));
  const inertial_world::SmoothMotion path(4);
  const Preintegration::Noise density{1e-3, 1e-2};
  const StateWalk walk{1e-3, 1e-2, 1e-3};
  std::vector<Vec6> rates;
  for (int i = 0; i < 20; ++i) {
    const ImuSample s = path.reading({to_ns(0.005 * i)}, gravity.at(Vec2::Zero()));
    rates.emplace_back();
    rates.back() << s.angular_velocity_radps, s.specific_force_mps2;
  }
  const auto integrated = [&](Rng* rng, const ImuBias& bias) {
    Preintegration result(bias);
    for (const Vec6& rate : rates) {
      const double root = rng ? 1 / std::sqrt(0.005) : 0;
      const Vec3 w = rng ? inertial_world::normal_vector(*rng, root * 1e-3) : Vec3::Zero();
      const Vec3 a = rng ? inertial_world::normal_vector(*rng, root * 1e-2) : Vec3::Zero();
      result.add(rate.head<3>() + w, rate.tail<3>() + a, 0.005, density);
    }
    return result;
  };
  StateVector sigma;
  sigma << Vec3::Constant(0.01), Vec3::Constant(0.005), Vec3::Constant(0.02), Vec3::Constant(0.002),
      Vec3::Constant(0.03), Vec2::Constant(0.01);
  UncertainState start{{}, sigma.cwiseAbs2().asDiagonal()};
  start.state.velocity_odom_mps = {0.3, -0.2, 0.1};
  const UncertainState predicted =
      start.moved(MotionFactor(integrated(nullptr, {}), walk), {to_ns(0.1)}, gravity);

  Rng rng(5);
  constexpr int kRuns = 4000;
  StateMatrix sampled = StateMatrix::Zero();
  for (int run = 0; run < kRuns; ++run) {
    StateVector error;
    for (int i = 0; i < kStateSize; ++i) error[i] = rng.normal(0, sigma[i]);
    const InertialState other = changed(start.state, error);
    const InertialState end =
        MotionFactor(integrated(&rng, other.bias), walk).after(other, {to_ns(0.1)}, gravity);
    StateVector d = change_between(predicted.state, end);
    for (int i = 0; i < 3; ++i) {
      d[9 + i] += rng.normal(0, walk.gyro_radps2_sqrthz * std::sqrt(0.1));
      d[12 + i] += rng.normal(0, walk.accel_mps3_sqrthz * std::sqrt(0.1));
      if (i < 2) d[15 + i] += rng.normal(0, walk.tilt_rad_sqrts * std::sqrt(0.1));
    }
    sampled += d * d.transpose() / kRuns;
  }
  const Eigen::LLT<StateMatrix> root(predicted.covariance);
  const StateMatrix half = root.matrixL().solve(sampled);
  const StateMatrix whitened = root.matrixL().solve(half.transpose());
  EXPECT_LT((whitened - StateMatrix::Identity()).cwiseAbs().maxCoeff(), 0.12);
}

}  // namespace
}  // namespace ygslam
