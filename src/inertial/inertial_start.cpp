#include "inertial/inertial_start.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <utility>

namespace ygslam {
namespace {

constexpr double kMostGravityError_mps2 = 1.2;  // biases and what vision errs in a second
constexpr double kMostFit = 2.5;                // mean chi-square of a start
constexpr double kDegree = std::numbers::pi / 180;

/// Squared rotations between frames that the gyroscope leaves unexplained, and the bias that
/// explains most: linear in it (Forster et al., eq. (44)), in two steps.
Vec3 gyro_bias(std::span<const SeenFrame> frames, std::span<const Preintegration> motions) {
  ImuBias bias;
  for (int i = 0; i < 2; ++i) {
    Mat3 A = Mat3::Zero();
    Vec3 b = Vec3::Zero();
    for (std::size_t k = 0; k < motions.size(); ++k) {
      const Mat3 R_seen =
          frames[k].pose.T_odom_imu.R().transpose() * frames[k + 1].pose.T_odom_imu.R();
      const Mat3 J = motions[k].bias_jacobian().topLeftCorner<3, 3>();
      A += J.transpose() * J;
      b += J.transpose() * so3_log(motions[k].corrected(bias).R.transpose() * R_seen);
    }
    bias.gyro_radps += A.ldlt().solve(b);
  }
  return bias.gyro_radps;
}

/// Of all motions in a row.
std::vector<MotionDelta> composed(std::span<const Preintegration> motions) {
  std::vector<MotionDelta> sums(1);
  for (const Preintegration& motion : motions) sums.push_back(sums.back().then(motion.delta()));
  return sums;
}

/// The first attitude, as all frames see it.
Mat3 first_attitude(std::span<const SeenFrame> frames, std::span<const MotionDelta> sums) {
  const Mat3 R0 = frames.front().pose.T_odom_imu.R();
  Vec3 mean = Vec3::Zero();
  for (std::size_t k = 0; k < frames.size(); ++k)
    mean += so3_log(R0.transpose() * frames[k].pose.T_odom_imu.R() * sums[k].R.transpose());
  return R0 * so3_exp(mean / static_cast<double>(frames.size()));
}

struct Fall {
  Vec3 p, v, gravity;  // at the first frame
};

/// p_k = p + v t + g t^2/2 + R_0 dp_k: a parabola through what the IMU does not explain.
Fall fall(std::span<const SeenFrame> frames, std::span<const MotionDelta> sums, const Mat3& R0) {
  Mat3 A = Mat3::Zero();
  Mat3 b = Mat3::Zero();
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const double t = sums[k].duration_s;
    const Vec3 basis(1, t, 0.5 * t * t);
    A += basis * basis.transpose();
    b += basis * (frames[k].pose.T_odom_imu.t() - R0 * sums[k].p).transpose();
  }
  const Mat3 solved = A.ldlt().solve(b);
  return {solved.row(0).transpose(), solved.row(1).transpose(), solved.row(2).transpose()};
}

/// @param force_mps2 mean of what was measured, in the first attitude's axes.
ImuFault judge_gravity(double gravity_mps2, double force_mps2) {
  if (std::abs(gravity_mps2 - kStandardGravity_mps2) <= kMostGravityError_mps2)
    return ImuFault::kNone;
  return force_mps2 > 0.75 && force_mps2 < 1.3 ? ImuFault::kUnits : ImuFault::kGravity;
}

/// Whether the gyroscope turns as the camera does, a bias apart.
ImuFault judge_turns(std::span<const SeenFrame> frames, std::span<const Preintegration> motions) {
  double chi_square = 0;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const SeenPose &a = frames[k].pose, &b = frames[k + 1].pose;
    const Mat3 covariance =
        a.covariance.bottomRightCorner<3, 3>() + b.covariance.bottomRightCorner<3, 3>();
    const Vec3 error =
        so3_log(motions[k].delta().R.transpose() * a.T_odom_imu.R().transpose() * b.T_odom_imu.R());
    chi_square += error.dot(covariance.ldlt().solve(error));
  }
  return chi_square > kMostFit * 3 * static_cast<double>(motions.size()) ? ImuFault::kDisagrees
                                                                         : ImuFault::kNone;
}

/// Whether rates are in degrees: the motion that they tell is as many times that which is seen.
bool is_in_degrees(std::span<const SeenFrame> frames, std::span<const Preintegration> motions) {
  double both = 0, measured = 0, seen = 0;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    const Vec3 seen_turn =
        so3_log(frames[k].pose.T_odom_imu.R().transpose() * frames[k + 1].pose.T_odom_imu.R());
    const Vec3 turn = so3_log(motions[k].delta().R);
    both += seen_turn.dot(turn);
    measured += turn.squaredNorm();
    seen += seen_turn.squaredNorm();
  }
  const double ratio = both / measured / kDegree;
  return ratio > 0.7 && ratio < 1.4 && both * both > 0.25 * seen * measured;
}

ImuFault judge_bias(const ImuBias& bias, const ImuBounds& bounds) {
  const bool is_possible = bias.gyro_radps.norm() <= bounds.most_gyro_bias_radps &&
                           bias.accel_mps2.norm() <= bounds.most_accel_bias_mps2;
  return is_possible ? ImuFault::kNone : ImuFault::kBias;
}

StateMatrix loose_prior(const ImuBounds& bounds) {
  constexpr double kAnyPose = 1, kAnyVelocity_mps = 3, kAnyTilt_rad = 0.3;
  StateVector sigma;
  sigma << Vec6::Constant(kAnyPose), Vec3::Constant(kAnyVelocity_mps),
      Vec3::Constant(bounds.gyro_bias_sigma_radps), Vec3::Constant(bounds.accel_bias_sigma_mps2),
      Vec2::Constant(kAnyTilt_rad);
  return sigma.cwiseAbs2().cwiseInverse().asDiagonal();
}

}  // namespace

std::variant<InertialWindow, ImuFault> start_window(std::span<const SeenFrame> frames,
                                                    const Integrate& integrate,
                                                    const StateWalk& walk,
                                                    const ImuBounds& bounds) {
  std::vector<Preintegration> motions;
  const auto integrate_all = [&](const ImuBias& bias) {
    motions.clear();
    for (std::size_t i = 0; i + 1 < frames.size(); ++i) motions.push_back(integrate(i, bias));
  };
  integrate_all({});
  if (is_in_degrees(frames, motions)) return ImuFault::kUnits;
  const ImuBias bias{gyro_bias(frames, motions), Vec3::Zero()};
  integrate_all(bias);
  const auto sums = composed(motions);
  const Mat3 R0 = first_attitude(frames, sums);
  const Fall first = fall(frames, sums, R0);
  const double force_mps2 = sums.back().v.norm() / sums.back().duration_s;
  for (const ImuFault fault : {judge_turns(frames, motions), judge_bias(bias, bounds),
                               judge_gravity(first.gravity.norm(), force_mps2)})
    if (fault != ImuFault::kNone) return fault;

  InertialWindow window{TiltedGravity(first.gravity)};
  InertialState state{frames.front().stamp, SE3(R0, first.p), first.v, bias, Vec2::Zero()};
  InertialState prior_at = state;
  prior_at.bias = {};
  window.begin({prior_at, std::nullopt, frames.front().pose}, loose_prior(bounds));
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const MotionFactor motion(motions[i - 1], walk);
    state = motion.after(state, frames[i].stamp, window.gravity());
    window.add({state, motion, frames[i].pose});
  }
  if (!window.solve(6)) return ImuFault::kDisagrees;
  const auto [chi_square, freedom] = window.fit();
  if (chi_square > kMostFit * freedom) return ImuFault::kDisagrees;
  if (const ImuFault fault = judge_bias(window.nodes().back().state.bias, bounds);
      fault != ImuFault::kNone)
    return fault;
  return window;
}

}  // namespace ygslam
