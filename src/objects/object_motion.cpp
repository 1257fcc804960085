#include "objects/object_motion.hpp"

#include <algorithm>
#include <cmath>

namespace ygslam {
namespace {

// Learned by likelihood from people who walk at random in rendered rooms (docs/moving-things.md).
constexpr double kPositionSigma_m = 0.07;
constexpr double kVelocitySigma_mps = 0.5;  // of a velocity that is a mean over half a second
constexpr double kFirstSpeedSigma_mps = 1;  // of who was just found
constexpr double kAcceleration = 0.8;       // white noise [m / s^1.5], while it is followed
constexpr double kBodySigma_m = 0.08;       // the middle of a body, by the side that is seen
constexpr double kKeepsOn_s = 2;            // who walks will stop or turn, after so long on average
constexpr double kHiddenKeepsOn_s = 1;      // nobody sees whether he has
// White noise of a forecast's acceleration [m / s^1.5]. Who walks may stop, which changes the way
// along much more than turning changes it across.
constexpr double kNoise = 0.2;                // of whoever it is
constexpr double kNoiseOfSpeed_ps = 1;        // more along the way, for each m/s ...
constexpr double kFastest_mps = 1.5;          // ... up to here
constexpr double kOutlierSquaredSigmas = 16;  // a measurement farther off counts less

/// What a velocity that fades adds to the position.
double velocity_integral_s(double seconds, double keeps_on_s) {
  return keeps_on_s * (1 - std::exp(-seconds / keeps_on_s));
}

Mat6 transition(double way_s, double kept) {
  Mat6 F = Mat6::Identity();
  F.topRightCorner<3, 3>() *= 0;
  F.topRightCorner<3, 3>().diagonal().setConstant(way_s);
  F.bottomRightCorner<3, 3>() *= kept;
  return F;
}

/// White noise of the acceleration (Bar-Shalom, Li, Kirubarajan 2001, eq. 6.2.2-12).
Mat6 noise(double dt_s, const Mat3& squared) {
  Mat6 Q;
  Q << dt_s * dt_s * dt_s / 3 * squared, dt_s * dt_s / 2 * squared, dt_s * dt_s / 2 * squared,
      dt_s * squared;
  return Q;
}

void correct(ObjectMotion& state, int first, const Vec3& innovation, double sigma) {
  const Mat3 own = state.covariance.block<3, 3>(first, first);
  Mat3 S = own + sigma * sigma * Mat3::Identity();
  const double squared_sigmas = innovation.dot(S.ldlt().solve(innovation));
  S += std::max(0.0, squared_sigmas / kOutlierSquaredSigmas - 1) * sigma * sigma * Mat3::Identity();
  const Eigen::Matrix<double, 6, 3> K =
      S.ldlt().solve(state.covariance.middleRows<3>(first)).transpose();
  const Vec6 change = K * innovation;
  state.position_m += change.head<3>();
  state.velocity_mps += change.tail<3>();
  state.covariance -= K * state.covariance.middleRows<3>(first);
  state.covariance = 0.5 * (state.covariance + state.covariance.transpose()).eval();
}

}  // namespace

ObjectMotion ObjectMotion::after(double seconds) const {
  if (!(seconds > 0)) return *this;
  const double speed = velocity_mps.norm();
  const Vec3 along = speed > 0 ? Vec3(velocity_mps / speed) : Vec3::Zero();
  const double of_speed = kNoiseOfSpeed_ps * std::min(speed, kFastest_mps);
  const Mat3 squared =
      kNoise * kNoise * Mat3::Identity() + of_speed * of_speed * along * along.transpose();
  const Mat6 F =
      transition(velocity_integral_s(seconds, kKeepsOn_s), std::exp(-seconds / kKeepsOn_s));
  return {position_m + F(0, 3) * velocity_mps, F(3, 3) * velocity_mps,
          F * covariance * F.transpose() + noise(seconds, squared)};
}

ObjectMotion ObjectMotion::seen_from(const SE3& T) const {
  Mat6 R = Mat6::Zero();
  R.topLeftCorner<3, 3>() = R.bottomRightCorner<3, 3>() = T.R();
  return {T * position_m, T.R() * velocity_mps, R * covariance * R.transpose()};
}

void MotionFilter::predict(double seconds, bool hidden) {
  if (!has_begun_ || !(seconds > 0)) return;
  const double way = hidden ? velocity_integral_s(seconds, kHiddenKeepsOn_s) : seconds;
  const Mat6 F = transition(way, hidden ? std::exp(-seconds / kHiddenKeepsOn_s) : 1);
  state_ = {state_.position_m + F(0, 3) * state_.velocity_mps, F(3, 3) * state_.velocity_mps,
            F * state_.covariance * F.transpose() +
                noise(seconds, kAcceleration * kAcceleration * Mat3::Identity())};
}

void MotionFilter::update(const Vec3& position_m) {
  if (!position_m.allFinite()) return;
  if (has_begun_) return correct(state_, 0, position_m - state_.position_m, kPositionSigma_m);
  has_begun_ = true;
  state_.position_m = position_m;
  state_.covariance.diagonal() << Vec3::Constant(kPositionSigma_m * kPositionSigma_m),
      Vec3::Constant(kFirstSpeedSigma_mps * kFirstSpeedSigma_mps);
}

void MotionFilter::update_velocity(const Vec3& velocity_mps) {
  if (!has_begun_ || !velocity_mps.allFinite()) return;
  correct(state_, 3, velocity_mps - state_.velocity_mps, kVelocitySigma_mps);
}

ObjectMotion MotionFilter::motion() const {
  ObjectMotion seen = state_;
  seen.covariance.topLeftCorner<3, 3>().diagonal().array() += kBodySigma_m * kBodySigma_m;
  return seen;
}

}  // namespace ygslam
