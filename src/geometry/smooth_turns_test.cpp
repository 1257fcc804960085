#include "geometry/smooth_turns.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "core/rng.hpp"

namespace ygslam {
namespace {

constexpr double kTurnFrame_s = 1.0 / 30;
constexpr double kSeen_rad = 2e-3, kTurn_rad = 5e-5, kDistance_m = 2.5;
const Vec3 kBias_radps(0.01, -0.02, 0.005);
// What the gyroscope errs by within the second that a pose is held from.
constexpr double kHeld_rad = 5e-4;

SE3 turning_hand(int i) {
  const double t_s = i * kTurnFrame_s;
  return {so3_exp({0.5 * std::sin(3 * t_s), 0.4 * std::cos(2 * t_s), 0.2 * t_s}),
          {0.15 * std::sin(4 * t_s), 0.1 * std::cos(3 * t_s), 0.03 * std::sin(9 * t_s)}};
}

/// A camera that takes a wrong rotation for a shift of the points that it sees.
SE3 misled_by(const SE3& T, const Vec3& error_rad) {
  const Vec3 shift_m = kDistance_m * Vec3(-error_rad.y(), error_rad.x(), 0);
  return {T.R() * so3_exp(error_rad), T.t() + T.R() * shift_m};
}

Vec3 turn_noise(Rng& rng, double sigma) {
  return {rng.normal(0, sigma), rng.normal(0, sigma), rng.normal(0, sigma)};
}

struct TurningPath {
  std::vector<SE3> truth;
  std::vector<TurningPose> seen;
};

TurningPath turning_path(int frames, double seen_rad = kSeen_rad) {
  Rng rng(3);
  TurningPath path;
  for (int i = 0; i < frames; ++i) {
    const SE3 T = turning_hand(i);
    const Mat3 R_before_here = turning_hand(i - 1).R().transpose() * T.R();
    path.truth.push_back(T);
    path.seen.push_back(
        {{to_ns(i * kTurnFrame_s)},
         misled_by(T, turn_noise(rng, seen_rad)),
         4e-4,
         kDistance_m,
         so3_log(R_before_here * so3_exp(kTurnFrame_s * kBias_radps)) + turn_noise(rng, kTurn_rad),
         kTurn_rad});
  }
  return path;
}

double angle_between(const SE3& a, const SE3& b) { return (a.inverse() * b).angle(); }

struct TurnErrors {
  double rad = 0, m = 0;
};
TurnErrors turn_rms(const std::vector<SE3>& truth, const std::vector<SE3>& poses) {
  TurnErrors sum;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    sum.rad += std::pow(angle_between(truth[i], poses[i]), 2);
    sum.m += (truth[i].t() - poses[i].t()).squaredNorm();
  }
  const auto n = static_cast<double>(truth.size());
  return {std::sqrt(sum.rad / n), std::sqrt(sum.m / n)};
}

std::vector<SE3> seen_poses(const TurningPath& path) {
  std::vector<SE3> poses;
  for (const TurningPose& pose : path.seen) poses.push_back(pose.T_world_camera);
  return poses;
}

TEST(SmoothTurns, RotationsAreHeldByTheGyroscopeAndPositionsGoAlong) {
  const TurningPath path = turning_path(300);
  const TurnErrors before = turn_rms(path.truth, seen_poses(path));
  const TurnErrors after = turn_rms(path.truth, smooth_turns(path.seen));
  EXPECT_GT(before.rad, 1.5 * kSeen_rad);
  EXPECT_LT(after.rad, 0.25 * before.rad);
  EXPECT_LT(after.m, 0.25 * before.m);
}

TEST(SmoothTurns, PosesWithoutErrorStayWhereTheyAre) {
  const TurningPath path = turning_path(100, 0);
  const TurnErrors after = turn_rms(path.truth, smooth_turns(path.seen));
  EXPECT_LT(after.rad, kHeld_rad);
}

TEST(SmoothTurns, WhereNoTurnIsKnownNothingIsChanged) {
  TurningPath path = turning_path(60);
  for (TurningPose& pose : path.seen) pose.turn_std_rad = 0;
  const auto poses = smooth_turns(path.seen);
  ASSERT_EQ(poses.size(), 60U);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].t(), path.seen[i].T_world_camera.t()) << i;
    EXPECT_EQ(poses[i].R(), path.seen[i].T_world_camera.R()) << i;
  }
  EXPECT_TRUE(smooth_turns({}).empty());
}

TEST(SmoothTurns, AGyroscopeThatIsNotOfThisCameraIsLeftOut) {
  TurningPath path = turning_path(300);
  for (TurningPose& pose : path.seen) pose.turn_rad = Vec3(pose.turn_rad.y(), pose.turn_rad.x(), 0);
  const auto poses = smooth_turns(path.seen);
  for (std::size_t i = 0; i < poses.size(); ++i)
    EXPECT_EQ(poses[i].t(), path.seen[i].T_world_camera.t()) << i;
}

TEST(SmoothTurns, ABiasThatDriftsIsFollowedOnALongRun) {
  TurningPath path = turning_path(6000, 0);
  for (std::size_t i = 0; i < path.seen.size(); ++i)
    path.seen[i].turn_rad +=
        kTurnFrame_s * Vec3(1e-5 * kTurnFrame_s * static_cast<double>(i), 0, 0);
  const auto poses = smooth_turns(path.seen);
  ASSERT_EQ(poses.size(), path.seen.size());
  EXPECT_LT(turn_rms(path.truth, poses).rad, 1.5 * kHeld_rad);
}

TEST(SmoothTurns, NothingLeaksWhereTheCameraWasPutSomewhereElseOrTheTurnIsNotKnown) {
  for (const bool jumps : {true, false}) {
    TurningPath path = turning_path(120, 0);
    for (std::size_t i = 60; i < 120; ++i) {
      const SE3 moved(so3_exp({0, 0, jumps ? 0.2 : 0.02}), {1, 0, 0});
      path.truth[i] = moved * path.truth[i];
      path.seen[i].T_world_camera = moved * path.seen[i].T_world_camera;
    }
    if (!jumps) path.seen[60].turn_std_rad = 0;
    EXPECT_LT(turn_rms(path.truth, smooth_turns(path.seen)).rad, kHeld_rad) << jumps;
  }
}

TEST(SmoothTurns, AWrongPoseDoesItsNeighboursNoHarm) {
  TurningPath path = turning_path(120, 0);
  TurningPose& wrong = path.seen[60];
  wrong.T_world_camera = misled_by(wrong.T_world_camera, {0.03, 0.02, 0});
  const auto poses = smooth_turns(path.seen);
  for (std::size_t i = 0; i < poses.size(); ++i)
    EXPECT_LT(angle_between(path.truth[i], poses[i]), 3 * kHeld_rad) << i;
  EXPECT_LT((poses[60].t() - path.truth[60].t()).norm(), 0.006) << "it was 9 cm off";
}

TEST(SmoothTurns, APoseThatIsUnsureOfItsRotationCountsLess) {
  TurningPath path = turning_path(120, 0);
  for (std::size_t i = 40; i < 80; ++i) {  // an error that lasts
    path.seen[i].T_world_camera = misled_by(path.seen[i].T_world_camera, {0.004, 0, 0});
    path.seen[i].std_rad = 4e-3;
  }
  const auto poses = smooth_turns(path.seen);
  EXPECT_LT(angle_between(path.truth[60], poses[60]), 0.001);
}

/// Normal equations of points that a camera sees, depth not measured.
Mat6 covariance_of_view(double distance_m) {
  Mat6 information = 1e-3 * Mat6::Identity();
  for (double x = -0.4; x < 0.5; x += 0.2) {
    for (double y = -0.3; y < 0.4; y += 0.2) {
      const Vec3 p = distance_m * Vec3(x, y, 1);
      Eigen::Matrix<double, 3, 6> by_twist;
      by_twist << Mat3::Identity(), -skew(p);
      Eigen::Matrix<double, 2, 3> by_point;
      by_point << 1 / p.z(), 0, -p.x() / (p.z() * p.z()), 0, 1 / p.z(), -p.y() / (p.z() * p.z());
      const Eigen::Matrix<double, 2, 6> J = 500 * by_point * by_twist;
      information += J.transpose() * J;
    }
  }
  return information.inverse();
}

TEST(SmoothTurns, TheDistanceOfPointsIsToldByThePosesCovariance) {
  for (const double distance_m : {1.0, 2.0, 4.0})
    EXPECT_NEAR(distance_of_points(covariance_of_view(distance_m)), distance_m, 0.1 * distance_m);
  EXPECT_EQ(distance_of_points(Mat6::Zero()), 0);
  EXPECT_EQ(distance_of_points(Mat6::Identity()), 0);
}

}  // namespace
}  // namespace ygslam
