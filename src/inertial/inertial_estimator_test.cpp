#include "inertial/inertial_estimator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/statistics.hpp"
#include "inertial/estimator_test_world.hpp"

namespace ygslam {
namespace {

using inertial_world::Coasted;
using inertial_world::coasted;
using inertial_world::Drive;
using inertial_world::DriveOptions;
using inertial_world::kMostNees;
using inertial_world::kSeeds;
using inertial_world::kWindows;
using inertial_world::share_within_bounds;

double tilt_error(Drive& drive) {
  const Vec3 found = drive.estimator().gravity_odom()->normalized();
  return std::acos(std::min(1.0, found.dot(drive.true_gravity_odom().normalized())));
}

double highest(const std::vector<double>& values) { return std::ranges::max(values); }

TEST(InertialEstimator, FindsBiasesAndGravityWhileMoving) {
  std::vector<double> gyro, accel, tilt;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    Drive drive({.seed = seed});
    drive.run(10);
    ASSERT_TRUE(drive.estimator().is_trusted()) << seed;
    const ImuBias found = drive.estimator().state()->state.bias;
    gyro.push_back((found.gyro_radps - drive.true_bias().gyro_radps).norm());
    accel.push_back((found.accel_mps2 - drive.true_bias().accel_mps2).norm());
    tilt.push_back(tilt_error(drive));
  }
  EXPECT_LT(highest(gyro), 5e-4);
  EXPECT_LT(median(gyro), 2.5e-4);
  EXPECT_LT(highest(accel), 0.08);
  EXPECT_LT(median(accel), 0.02);
  EXPECT_LT(highest(tilt), 0.008);
  EXPECT_LT(median(tilt), 0.002);
}

// A tilt and a bias that look alike cannot be told apart at rest, but what they make together can.
TEST(InertialEstimator, FindsWhatItNeedsWhileStandingStill) {
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    Drive drive({.seed = seed, .liveliness = 0});
    drive.run(5);
    ASSERT_TRUE(drive.estimator().is_trusted()) << seed;
    const InertialState found = drive.estimator().state()->state;
    EXPECT_LT((found.bias.gyro_radps - drive.true_bias().gyro_radps).norm(), 1e-3) << seed;
    const Vec3 fall =
        drive.true_imu_pose().R() * (drive.true_bias().accel_mps2 - found.bias.accel_mps2) -
        drive.true_gravity_odom() + *drive.estimator().gravity_odom();
    EXPECT_LT(fall.norm(), 0.03) << seed;
  }
}

TEST(InertialEstimator, StartsWithinTheFirstSecondAndAHalf) {
  for (const double liveliness : {0.0, 1.0}) {
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      Drive drive({.seed = seed, .liveliness = liveliness});
      drive.run(0.5);
      EXPECT_FALSE(drive.estimator().started());
      EXPECT_FALSE(drive.estimator().predict(drive.now()));
      drive.run(1);
      EXPECT_TRUE(drive.estimator().started()) << seed;
      EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kNone);
    }
  }
}

TEST(InertialEstimator, PredictsAFrameBeforeItIsSeen) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Drive drive({.seed = seed});
    drive.run(3);
    double worst_m = 0, worst_rad = 0, worst_mps = 0;
    drive.before_frame = [&](Drive& d) {
      const auto predicted = d.estimator().predict(d.now());
      ASSERT_TRUE(predicted);
      const SE3 error = predicted->T_odom_camera.inverse() * d.true_pose();
      worst_m = std::max(worst_m, error.t().norm());
      worst_rad = std::max(worst_rad, error.angle());
      constexpr double kStep_s = 1e-4;
      const double t_s = 1e-9 * static_cast<double>(d.now().ns);
      const Vec6 velocity =
          (d.true_pose(t_s - kStep_s).inverse() * d.true_pose(t_s + kStep_s)).log() / (2 * kStep_s);
      worst_mps = std::max(worst_mps, (predicted->body_velocity - velocity).norm());
      EXPECT_NEAR(predicted->unseen_s, Drive::kFrame_s, 1e-6);
    };
    drive.run(2);
    EXPECT_LT(worst_m, 4e-3) << seed;
    EXPECT_LT(worst_rad, 1.5e-3) << seed;
    EXPECT_LT(worst_mps, 0.04) << seed;  // rad/s of the rotation's noise included
  }
}

void expect_predictions(const Coasted& result, double seconds, int windows) {
  ASSERT_EQ(result.error_m.size(), kSeeds * static_cast<std::uint64_t>(windows));
  for (const double unseen_s : result.unseen_s)
    EXPECT_NEAR(unseen_s, seconds, 0.5 * Drive::kFrame_s);
  EXPECT_TRUE(result.goes_on);
}

void expect_coasts(double seconds, double median_m, double most_m) {
  for (const double liveliness : {0.0, 1.0}) {
    const Coasted result = coasted(seconds, {.liveliness = liveliness});
    expect_predictions(result, seconds, kWindows);
    EXPECT_GE(share_within_bounds(result.nees), 0.9);
    EXPECT_LT(highest(result.error_m), most_m);
    EXPECT_LT(median(std::vector(result.error_m)), median_m);
  }
}

TEST(InertialEstimator, CoastsATenthOfASecond) { expect_coasts(0.1, 0.0025, 0.006); }
TEST(InertialEstimator, CoastsASecond) { expect_coasts(1, 0.008, 0.02); }
TEST(InertialEstimator, CoastsFiveSeconds) { expect_coasts(5, 0.1, 0.35); }

// As calibration leaves a chip: scales off by 2 per mille, axes by a tenth of a degree.
TEST(InertialEstimator, ScaleErrorsAreInItsCovariance) {
  DriveOptions options{.gyro_scale_error = 0.002};
  options.distort = [](ImuSample& s) {
    const Vec3 w = s.angular_velocity_radps;
    s.angular_velocity_radps +=
        Vec3(0.002, -0.002, 0.002).cwiseProduct(w) + 0.0017 * Vec3(0, 0, 1).cross(w);
    return true;
  };
  for (const double seconds : {1.0, 5.0}) {
    const Coasted result = coasted(seconds, options, 1);
    expect_predictions(result, seconds, 1);
    const auto within = std::ranges::count_if(result.nees, [](double n) { return n < kMostNees; });
    EXPECT_GE(static_cast<double>(within), 0.9 * static_cast<double>(result.nees.size()));
  }
}

TEST(InertialEstimator, IsLessCertainTheLongerNothingIsSeen) {
  Drive drive({.seed = 1});
  drive.run(5);
  double before_m = 0;
  for (int i = 0; i < 5; ++i) {
    drive.run(1, false);
    const Mat6 covariance = drive.estimator().predict(drive.now())->covariance;
    const double std_m = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
    EXPECT_GT(std_m, 1.5 * before_m);
    before_m = std_m;
  }
}

TEST(InertialEstimator, FindsTheClocksOffset) {
  for (const double offset_s : {-0.06, -0.01, 0.025, 0.08}) {
    Drive drive({.seed = 2, .liveliness = 2, .offset_s = offset_s});
    drive.run(6);
    EXPECT_TRUE(drive.estimator().time_offset_is_known());
    EXPECT_NEAR(drive.estimator().time_offset_s(), offset_s, 2e-3);
    ASSERT_TRUE(drive.estimator().is_trusted()) << offset_s;
    drive.run(0.5, false);
    const auto predicted = drive.estimator().predict(drive.now());
    ASSERT_TRUE(predicted);
    EXPECT_LT(drive.error_of(*predicted).head<3>().norm(), 0.02);
  }
}

TEST(InertialEstimator, AWrongPoseNowAndThenDoesNoHarm) {
  Drive drive({.seed = 3});
  drive.run(5);
  for (int i = 0; i < 10; ++i) {
    drive.run(0.3);
    drive.advance();
    VisualPose wrong = drive.seen_pose();
    wrong.T_odom_camera = wrong.T_odom_camera * SE3(so3_exp({0.1, 0, 0}), {0.2, 0.1, 0});
    drive.estimator().add_frame(drive.now(), wrong);
  }
  drive.run(0.1);
  EXPECT_TRUE(drive.estimator().is_trusted());
  EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kNone);
  drive.run(1, false);
  EXPECT_LT(drive.error_of(*drive.estimator().predict(drive.now())).head<3>().norm(), 0.02);
}

// Found again somewhere else in odom: velocity, biases and gravity go along.
TEST(InertialEstimator, GoesOnWhereItIsFoundAgain) {
  Drive drive({.seed = 4});
  drive.run(8);
  drive.run(3, false);
  drive.advance();
  const SE3 T_new_old(so3_exp({0.7, -0.4, 1.1}), {3, -2, 1});
  const auto in_new = [&](VisualPose pose) {
    pose.T_odom_camera = T_new_old * pose.T_odom_camera;
    return pose;
  };
  drive.estimator().add_frame_found_again(drive.now(), in_new(drive.seen_pose()));
  drive.run(0.5, false);
  ASSERT_TRUE(drive.estimator().started());
  const auto predicted = drive.estimator().predict(drive.now());
  ASSERT_TRUE(predicted);
  const SE3 error = (T_new_old * drive.true_pose()).inverse() * predicted->T_odom_camera;
  const double std_m = std::sqrt(predicted->covariance.topLeftCorner<3, 3>().trace());
  EXPECT_LT(error.t().norm(), 3 * std_m + 0.005);
  EXPECT_LT(error.t().norm(), 0.1);
  EXPECT_LT(error.angle(), 0.02);
  const Vec3 gravity = T_new_old.R() * drive.true_gravity_odom();
  EXPECT_LT((*drive.estimator().gravity_odom() - gravity).norm(), 0.3);
}

// What a weak pose errs by turns gravity along: a second without vision drifts no farther.
TEST(InertialEstimator, IsTrustedAsBeforeWhereItIsFoundAgainByAWeakPose) {
  Drive drive({.seed = 4});
  drive.run(8);
  drive.run(1, false);
  drive.advance();
  VisualPose weak = drive.seen_pose();
  weak.covariance.diagonal() << Vec3::Constant(0.05 * 0.05), Vec3::Constant(0.03 * 0.03);
  weak.T_odom_camera = weak.T_odom_camera * SE3(so3_exp({0.03, -0.02, 0.03}), {0.05, 0, -0.05});
  drive.estimator().add_frame_found_again(drive.now(), weak);
  EXPECT_TRUE(drive.estimator().is_trusted());
  const SE3 T_weak_true = weak.T_odom_camera * drive.true_pose().inverse();
  drive.run(1, false);
  const auto predicted = drive.estimator().predict(drive.now());
  ASSERT_TRUE(predicted && predicted->trusted);
  const SE3 drift = (T_weak_true * drive.true_pose()).inverse() * predicted->T_odom_camera;
  EXPECT_LT(drift.t().norm(), 0.05);
  EXPECT_LT(drive.error_of(*predicted).head<3>().norm(),
            3 * std::sqrt(predicted->covariance.topLeftCorner<3, 3>().trace()));
}

// A few corners on a white wall: vision leans more and more, and says so.
TEST(InertialEstimator, OdomThatDriftsTakesVelocityAndGravityAlong) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Drive drive({.seed = seed});
    drive.run(6);
    SE3 T_drifted_odom;
    for (int i = 0; i < 90; ++i) {
      drive.advance();
      T_drifted_odom = T_drifted_odom * SE3(so3_exp({0.0004, -0.0004, 0.0004}), Vec3::Zero());
      VisualPose pose = drive.seen_pose();
      pose.T_odom_camera = T_drifted_odom * pose.T_odom_camera;
      pose.drift = {1e-6, 4e-6};
      drive.estimator().add_frame(drive.now(), pose);
    }
    const Vec3 down_odom = T_drifted_odom.R() * drive.true_gravity_odom();
    EXPECT_LT((*drive.estimator().gravity_odom() - down_odom).norm(), 0.12) << seed;
    drive.run(1, false);
    const auto predicted = drive.estimator().predict(drive.now());
    ASSERT_TRUE(predicted) << seed;
    const SE3 error = (T_drifted_odom * drive.true_pose()).inverse() * predicted->T_odom_camera;
    EXPECT_LT(error.t().norm(), 0.06) << seed;
  }
}

// A moment of vision after seconds without it tells nothing of the IMU.
TEST(InertialEstimator, IsTrustedAsBeforeAfterAMomentOfVision) {
  Drive drive({.seed = 4, .seen_position_m = 0.02, .seen_rotation_rad = 0.02});
  drive.run(10);
  for (int i = 0; i < 4; ++i) {
    drive.run(4, false);
    drive.advance();
    drive.estimator().add_frame_found_again(drive.now(), drive.seen_pose());
    drive.advance();
    const auto predicted = drive.estimator().predict(drive.now());
    ASSERT_TRUE(predicted) << i;
    EXPECT_TRUE(predicted->trusted) << i;
  }
}

TEST(InertialEstimator, APoseWithoutAnyErrorIsTakenAsVeryGood) {
  Drive drive({.seed = 2});
  for (int i = 0; i < 60; ++i) {
    drive.advance();
    drive.estimator().add_frame(drive.now(), VisualPose{drive.true_pose(), Mat6::Zero()});
  }
  ASSERT_TRUE(drive.estimator().is_trusted());
  drive.run(1, false);
  EXPECT_LT(drive.error_of(*drive.estimator().predict(drive.now())).head<3>().norm(), 0.02);
}

/// For half a second vision goes along with something that moves by so many metres a second.
void take_along(Drive& drive, double speed_mps) {
  for (int i = 1; i <= 15; ++i) {
    drive.advance();
    VisualPose pose = drive.seen_pose();
    const Vec3 along_m(i * Drive::kFrame_s * speed_mps, 0, 0);
    pose.T_odom_camera = SE3(Mat3::Identity(), along_m) * pose.T_odom_camera;
    drive.estimator().add_frame(drive.now(), pose);
  }
}

TEST(InertialEstimator, GoesBackToBeforeVisionWasTakenAlong) {
  std::vector<double> kept, gone_back;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    for (const bool goes_back : {false, true}) {
      Drive drive({.seed = seed});
      drive.run(8);
      take_along(drive, 0.05);
      drive.advance();
      const auto predicted = drive.estimator().predict(drive.now());
      ASSERT_TRUE(predicted && predicted->earlier);
      PosePrediction earlier = *predicted;
      earlier.T_odom_camera = predicted->earlier->T_odom_camera;
      EXPECT_LT(drive.error_of(earlier).head<3>().norm(), 0.012) << seed;
      EXPECT_GT(predicted->earlier->covariance(0, 0), predicted->covariance(0, 0));
      if (goes_back) drive.estimator().go_back(drive.now());
      drive.estimator().add_frame(drive.now(), std::nullopt);
      drive.run(1, false);
      const auto after = drive.estimator().predict(drive.now());
      ASSERT_TRUE(after);
      EXPECT_NEAR(after->unseen_s, goes_back ? 1.5 : 1, 0.1);
      (goes_back ? gone_back : kept).push_back(drive.error_of(*after).head<3>().norm());
      if (goes_back) {
        EXPECT_LT(drive.nees_of(*after), 30) << seed;
      }
    }
  }
  EXPECT_LT(highest(gone_back), 0.03);
  EXPECT_GT(median(kept), 0.04) << "what it was told became a velocity";
}

TEST(InertialEstimator, AFrameFoundAgainThatWaitsIsForgottenWhereItGoesBack) {
  std::vector<ImuSample> late;
  bool is_late = false;
  DriveOptions options{.seed = 3};
  options.distort = [&](ImuSample& sample) {
    if (is_late) late.push_back(sample);
    return !is_late;
  };
  Drive drive(options);
  drive.run(8);
  is_late = true;
  drive.advance();
  drive.estimator().add_frame_found_again(drive.now(), drive.seen_pose());
  drive.estimator().go_back(drive.now());
  for (const ImuSample& sample : late) drive.estimator().add(sample);
  is_late = false;
  drive.run(1, false);
  const auto predicted = drive.estimator().predict(drive.now());
  ASSERT_TRUE(predicted);
  EXPECT_NEAR(predicted->unseen_s, 1.5, 0.04);
  EXPECT_LT(drive.error_of(*predicted).head<3>().norm(), 0.03);
}

TEST(InertialEstimator, GoneBackToAFrameThatSawNothingItKnowsSinceWhen) {
  Drive drive({.seed = 3});
  drive.run(8);
  drive.run(0.4, false);
  drive.run(0.2);
  drive.advance();
  drive.estimator().go_back(drive.now());
  EXPECT_NEAR(drive.estimator().predict(drive.now())->unseen_s, 0.6 + Drive::kFrame_s, 1e-3);
}

TEST(InertialEstimator, GoingBackDoesNotEndAnAgreementThatHasJustBegun) {
  Drive drive({.seed = 3});
  drive.run(5);
  while (!drive.estimator().predict(drive.now())->agreed) drive.run(Drive::kFrame_s);
  drive.advance();
  drive.estimator().go_back(drive.now());
  drive.estimator().add_frame(drive.now(), std::nullopt);
  for (int i = 0; i < 30; ++i) {
    drive.run(Drive::kFrame_s, false);
    EXPECT_TRUE(drive.estimator().predict(drive.now())->agreed) << i;
  }
}

TEST(InertialEstimator, TellsHowTheCameraTurnedBetweenTwoFrames) {
  Drive drive({.seed = 3});
  drive.run(4);
  for (int i = 0; i < 30; ++i) {
    const Timestamp before = drive.now();
    const Mat3 R_before = drive.true_pose().R();
    drive.step();
    const auto turn = drive.estimator().turn(before, drive.now());
    ASSERT_TRUE(turn);
    const Mat3 R_before_after = R_before.transpose() * drive.true_pose().R();
    const Vec3 bias_radps = drive.true_camera_bias_radps();
    const Vec3 turn_rad = turn->turn_rad - Drive::kFrame_s * bias_radps;
    const double error_rad = so3_log(R_before_after.transpose() * so3_exp(turn_rad)).norm();
    EXPECT_LT(error_rad, 4 * std::sqrt(3.0) * turn->std_rad) << i;
    EXPECT_LT(turn->std_rad, 2e-4);
  }
  EXPECT_FALSE(drive.estimator().turn({drive.now().ns - to_ns(0.5)}, drive.now()))
      << "these are not two frames of one path";
  EXPECT_FALSE(drive.estimator().turn(drive.now(), {drive.now().ns + to_ns(Drive::kFrame_s)}))
      << "its readings have not come yet";
}

TEST(InertialEstimator, TellsNoTurnWhereSamplesAreMissing) {
  bool is_bad = false;
  DriveOptions options{.seed = 3};
  options.distort = [&](ImuSample&) { return !is_bad; };
  Drive drive(options);
  drive.run(4);
  const Timestamp before = drive.now();
  is_bad = true;
  drive.advance();
  is_bad = false;
  drive.step();
  EXPECT_FALSE(drive.estimator().turn(before, drive.now()));
}

TEST(InertialEstimator, AgreesAfterSecondsInWhichVisionSaidTheSame) {
  Drive drive({.seed = 3});
  const auto agreed = [&] { return drive.estimator().predict(drive.now())->agreed; };
  drive.run(5);
  EXPECT_FALSE(agreed());
  EXPECT_FALSE(drive.estimator().predict(drive.now())->earlier) << "nobody needs it";
  drive.run(2);
  EXPECT_TRUE(agreed());
  drive.run(1, false);
  EXPECT_TRUE(agreed()) << "when it was there last";
  drive.advance();
  VisualPose elsewhere = drive.seen_pose();
  elsewhere.T_odom_camera = SE3(Mat3::Identity(), Vec3(0.3, 0, 0)) * elsewhere.T_odom_camera;
  drive.estimator().add_frame(drive.now(), elsewhere);
  EXPECT_FALSE(agreed());
  drive.run(6);
  EXPECT_TRUE(agreed());
  drive.advance();
  drive.estimator().add_frame_found_again(drive.now(), drive.seen_pose());
  EXPECT_FALSE(agreed());
}

}  // namespace
}  // namespace ygslam
