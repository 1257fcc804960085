// A robot on two wheels along a curve with stops, whose camera sees with small errors.
#include "inertial/wheel_odometry.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <functional>

#include "core/rng.hpp"

namespace ygslam {
namespace {

struct RobotOptions {
  std::uint64_t seed = 1;
  double left_scale = 1, right_scale = 1;        ///< told way for a true one, of each wheel
  double mount_yaw_rad = 0;                      ///< that the calibration does not know
  double unit = 1;                               ///< of the told way, metres
  double slip_from_s = 1e9, slip_until_s = 1e9;  ///< the left wheel turns half as far again
  std::function<bool(OdometrySample&)> distort{};
};

/// x right, y down, z ahead of a camera that looks along the base's x axis, 0.3 m above and before.
SE3 camera_on_base() {
  Mat3 R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {R, Vec3(0.2, 0, 0.3)};
}

class Robot {
 public:
  explicit Robot(const RobotOptions& options)
      : options_(options), rng_(options.seed), wheels_({.T_base_camera = camera_on_base()}) {}

  static constexpr double kFrame_s = 1.0 / 30, kSample_s = 0.02, kTrack_m = 0.35;

  void step(bool seen = true) {
    now_s_ += kFrame_s;
    feed();
    wheels_.add_frame(now(), seen ? std::optional(seen_pose()) : std::nullopt);
  }
  void run(double seconds, bool seen = true) {
    for (int i = 0; i < std::lround(seconds / kFrame_s); ++i) step(seen);
  }
  [[nodiscard]] Timestamp now() const { return {to_ns(now_s_)}; }
  [[nodiscard]] WheelOdometry& wheels() { return wheels_; }
  [[nodiscard]] SE3 true_pose() const {
    const SE3 turned(so3_exp(Vec3(0, 0, options_.mount_yaw_rad)), Vec3::Zero());
    const SE3 T_base_camera = turned * camera_on_base();
    return T_base_camera.inverse() * base_at(now_s_) * T_base_camera;
  }
  [[nodiscard]] Vec6 error() const {
    return (true_pose().inverse() * wheels_.predict(now())->T_odom_camera).log();
  }
  [[nodiscard]] double nees() const {
    const Vec6 e = error();
    return e.dot(wheels_.predict(now())->covariance.ldlt().solve(e));
  }

 private:
  /// Up to 0.6 m/s and 0.7 rad/s.
  static Vec6 twist_at(double t_s) {
    Vec6 twist = Vec6::Zero();
    twist[0] = 0.3 + 0.3 * std::sin(0.7 * t_s);
    twist[5] = 0.5 * std::sin(0.9 * t_s) + 0.2 * std::sin(0.31 * t_s);
    return twist;
  }
  [[nodiscard]] SE3 base_at(double t_s) const {
    constexpr double kStep_s = 0.002;
    while (truth_s_ + kStep_s / 2 < t_s) {
      truth_ = truth_ * SE3::exp(kStep_s * twist_at(truth_s_ + kStep_s / 2));
      truth_s_ += kStep_s;
    }
    return truth_ * SE3::exp((t_s - truth_s_) * twist_at(t_s));
  }
  void feed() {
    for (; next_s_ <= now_s_ + 0.02; next_s_ += kSample_s) {
      OdometrySample sample{{to_ns(next_s_)}, told_};
      if (!options_.distort || options_.distort(sample)) wheels_.add(sample);
      const Vec6 twist = kSample_s * twist_at(next_s_ + kSample_s / 2);
      const bool slips = next_s_ >= options_.slip_from_s && next_s_ < options_.slip_until_s;
      const auto way_of = [&](double side, double scale) {
        const double way_m = twist[0] + side * kTrack_m * twist[5];
        return scale * way_m + rng_.normal(0, 0.001 * std::sqrt(std::abs(way_m)));
      };
      const double left_m = way_of(-0.5, options_.left_scale) * (slips ? 1.5 : 1);
      const double right_m = way_of(0.5, options_.right_scale);
      Vec6 told = Vec6::Zero();
      told[0] = options_.unit * (left_m + right_m) / 2;
      told[5] = (right_m - left_m) / kTrack_m;
      told_ = told_ * SE3::exp(told);
    }
  }
  [[nodiscard]] VisualPose seen_pose() {
    Vec6 sigma, error;
    sigma << Vec3::Constant(0.002), Vec3::Constant(0.003);
    for (int i = 0; i < 6; ++i) error[i] = rng_.normal(0, sigma[i]);
    return {true_pose() * SE3::exp(error), sigma.cwiseAbs2().asDiagonal()};
  }

  RobotOptions options_;
  Rng rng_;
  WheelOdometry wheels_;
  SE3 told_;
  double now_s_ = 0, next_s_ = -0.1;
  mutable SE3 truth_;
  mutable double truth_s_ = 0;
};

TEST(WheelOdometry, CarriesOnForFiveSecondsAsWellAsItSays) {
  int within = 0;
  constexpr int kRobots = 40;
  for (std::uint64_t seed = 1; seed <= kRobots; ++seed) {
    Robot robot({.seed = seed});
    robot.run(6 + 0.3 * static_cast<double>(seed % 7));
    ASSERT_TRUE(robot.wheels().is_trusted());
    robot.run(5, false);
    EXPECT_LT(robot.error().head<3>().norm(), 0.06) << seed;  // 2 % of 3 m
    within += robot.nees() < 14.45 ? 1 : 0;                   // 95 % of chi-square, 6 degrees
  }
  EXPECT_GE(within, 36);
}

TEST(WheelOdometry, TheCovarianceGrowsWithTheWay) {
  Robot robot({});
  robot.run(6);
  double before_m2 = 0;
  for (int i = 0; i < 10; ++i) {
    robot.run(0.5, false);
    const double now_m2 =
        robot.wheels().predict(robot.now())->covariance.topLeftCorner<3, 3>().trace();
    EXPECT_GT(now_m2, before_m2);
    before_m2 = now_m2;
  }
}

TEST(WheelOdometry, FindsWheelsOfAnotherRadiusAndACameraThatIsTurned) {
  Robot robot({.left_scale = 1.04, .right_scale = 1.04, .mount_yaw_rad = 0.02});
  robot.run(20);
  EXPECT_TRUE(robot.wheels().is_trusted());
  EXPECT_EQ(robot.wheels().slips(), 0);
  EXPECT_NEAR(robot.wheels().errors()[0], 1 / 1.04 - 1, 0.006);
  robot.run(5, false);
  EXPECT_LT(robot.error().head<3>().norm(), 0.05);
  EXPECT_LT(robot.nees(), 22.5);
}

TEST(WheelOdometry, AWheelThatSpinsIsSeen) {
  Robot robot({.slip_from_s = 10, .slip_until_s = 10.4});
  robot.run(9.9);
  EXPECT_EQ(robot.wheels().slips(), 0);
  EXPECT_TRUE(robot.wheels().is_trusted());
  robot.run(0.4);
  EXPECT_EQ(robot.wheels().slips(), 1);
  EXPECT_FALSE(robot.wheels().is_trusted());
  EXPECT_FALSE(robot.wheels().predict(robot.now())->trusted);
  robot.run(3);
  EXPECT_TRUE(robot.wheels().is_trusted()) << "they hold again";
  EXPECT_EQ(robot.wheels().take_fault(), WheelFault::kNone);
  robot.run(5, false);
  EXPECT_LT(robot.error().head<3>().norm(), 0.06);
}

TEST(WheelOdometry, WaysOfAnotherUnitAreAnotherRobots) {
  Robot robot({.unit = 3});
  robot.run(20);
  EXPECT_EQ(robot.wheels().take_fault(), WheelFault::kDisagrees);
  EXPECT_FALSE(robot.wheels().is_trusted());
}

TEST(WheelOdometry, WhoHasNotMovedIsNotTrusted) {
  WheelOdometry wheels({.T_base_camera = camera_on_base()});
  for (int i = 0; i < 300; ++i) {
    wheels.add({{to_ns(0.02 * i)}, SE3()});
    if (i % 2 == 1)
      wheels.add_frame({to_ns(0.02 * i - 0.01)}, VisualPose{SE3(), 1e-6 * Mat6::Identity()});
  }
  ASSERT_TRUE(wheels.predict({to_ns(5.99)}));
  EXPECT_FALSE(wheels.predict({to_ns(5.99)})->trusted);
}

TEST(WheelOdometry, PosesThatComeLaterThanImagesDo) {
  std::deque<OdometrySample> late;
  Robot* driven = nullptr;
  Robot robot({.distort = [&](OdometrySample& sample) {
    late.push_back(sample);
    while (late.front().stamp.ns < sample.stamp.ns - to_ns(0.09)) {
      driven->wheels().add(late.front());
      late.pop_front();
    }
    return false;
  }});
  driven = &robot;
  robot.run(8);
  EXPECT_TRUE(robot.wheels().is_trusted());
  robot.run(3, false);
  ASSERT_TRUE(robot.wheels().predict(robot.now()));
  EXPECT_LT(robot.error().head<3>().norm(), 0.06);
}

TEST(WheelOdometry, AStreamThatStopsPredictsNothing) {
  Robot robot({.distort = [](OdometrySample& sample) { return sample.stamp.ns < to_ns(8.0); }});
  robot.run(7.9);
  EXPECT_TRUE(robot.wheels().predict(robot.now()));
  robot.run(0.5, false);
  EXPECT_FALSE(robot.wheels().predict(robot.now()));
  EXPECT_EQ(robot.wheels().take_fault(), WheelFault::kSilent);
}

TEST(WheelOdometry, ThatNoPoseComesIsAFaultOnce) {
  bool comes = false;
  Robot robot({.distort = [&](OdometrySample&) { return comes; }});
  robot.run(1.9);
  EXPECT_EQ(robot.wheels().take_fault(), WheelFault::kNone);
  robot.run(0.2);
  EXPECT_EQ(robot.wheels().take_fault(), WheelFault::kNoPoses);
  robot.run(5);
  EXPECT_EQ(robot.wheels().take_fault(), WheelFault::kNone);
  comes = true;
  robot.run(8);
  EXPECT_EQ(robot.wheels().take_fault(), WheelFault::kNone);
  EXPECT_TRUE(robot.wheels().is_trusted()) << "late, but there";
}

/// Neither its samples nor the work for a frame grow without end.
TEST(WheelOdometry, PredictsForHalfAMinuteWithoutVisionAndBeginsAnewWithIt) {
  Robot robot({});
  robot.run(5);
  robot.run(29, false);
  EXPECT_TRUE(robot.wheels().predict(robot.now()));
  robot.run(2, false);
  EXPECT_FALSE(robot.wheels().predict(robot.now()));
  robot.step();
  robot.run(0.5, false);
  EXPECT_TRUE(robot.wheels().predict(robot.now()));
}

TEST(WheelOdometry, StampsThatJumpAndACountBegunAnewCostWhatLiesBetween) {
  std::int64_t shift_ns = 0;
  SE3 T_anew_odom;
  Robot robot({.distort = [&](OdometrySample& sample) {
    sample.stamp.ns += shift_ns;
    sample.T_odom_base = T_anew_odom * sample.T_odom_base;
    return true;
  }});
  robot.run(6);
  shift_ns = -to_ns(30.0);  // and back after a while
  robot.run(0.1);
  shift_ns = 0;
  robot.run(3);
  EXPECT_TRUE(robot.wheels().is_trusted());
  T_anew_odom = SE3(so3_exp(Vec3(0, 0, 2)), Vec3(5, 5, 0));
  robot.run(0.1);
  EXPECT_EQ(robot.wheels().take_fault(), WheelFault::kJumped);
  robot.run(3);
  EXPECT_TRUE(robot.wheels().is_trusted());
  EXPECT_EQ(robot.wheels().slips(), 0);
  shift_ns = -to_ns(30.0);  // for good
  robot.run(0.25);
  EXPECT_EQ(robot.wheels().take_fault(), WheelFault::kClock);
  EXPECT_FALSE(robot.wheels().predict(robot.now()));
}

TEST(WheelMotion, DerivativesByTheErrorsAreThoseOfDifferences) {
  const WheelCalibration wheels{.T_base_camera = camera_on_base()};
  const auto camera_motion = [&](const WheelErrors& errors) {
    WheelSum sum(wheels);
    for (int i = 0; i < 100; ++i) {
      Vec6 step = Vec6::Zero();
      step[0] = 0.01, step[5] = 0.02 * std::sin(0.1 * i);
      sum.add(SE3::exp(step), 0.02, errors);
    }
    return sum.of_camera(errors);
  };
  const WheelMotion middle = camera_motion(WheelErrors::Zero());
  for (int i = 0; i < kWheelErrors; ++i) {
    constexpr double kStep = 1e-5;
    WheelErrors errors = WheelErrors::Zero();
    errors[i] = kStep;
    const Vec6 change =
        (middle.T_before_after.inverse() * camera_motion(errors).T_before_after).log() / kStep;
    EXPECT_LT((change - middle.by_errors.col(i)).norm(), 0.02 * change.norm() + 1e-3) << i;
  }
}

}  // namespace
}  // namespace ygslam
