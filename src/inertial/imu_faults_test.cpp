// IMUs that are not to be believed.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "inertial/estimator_test_world.hpp"

namespace ygslam {
namespace {

using inertial_world::Drive;
using inertial_world::DriveOptions;
using inertial_world::kMostNees;

using Distortion = std::function<bool(ImuSample&)>;

ImuFault fault_of(const Distortion& distort, bool expect_start = false) {
  Drive drive({.seed = 6, .liveliness = 1.5, .distort = distort});
  ImuFault fault = ImuFault::kNone;
  for (int i = 0; i < 120; ++i) {
    drive.step();
    if (const ImuFault now = drive.estimator().take_fault(); now != ImuFault::kNone) fault = now;
    EXPECT_TRUE(expect_start || !drive.estimator().started());
  }
  EXPECT_FALSE(drive.estimator().started());
  EXPECT_FALSE(drive.estimator().predict(drive.now()));
  return fault;
}

TEST(ImuFaults, AccelerationInUnitsOfGravity) {
  EXPECT_EQ(fault_of([](ImuSample& s) {
              s.specific_force_mps2 /= kStandardGravity_mps2;
              return true;
            }),
            ImuFault::kUnits);
}

TEST(ImuFaults, RatesInDegrees) {
  EXPECT_EQ(fault_of([](ImuSample& s) {
              s.angular_velocity_radps *= 180 / std::numbers::pi;
              return true;
            }),
            ImuFault::kUnits);
}

TEST(ImuFaults, AccelerationOfAnotherSize) {
  EXPECT_EQ(fault_of([](ImuSample& s) {
              s.specific_force_mps2 *= 1.3;
              return true;
            }),
            ImuFault::kGravity);
}

TEST(ImuFaults, AxesSwapped) {
  EXPECT_EQ(fault_of([](ImuSample& s) {
              std::swap(s.angular_velocity_radps.x(), s.angular_velocity_radps.y());
              std::swap(s.specific_force_mps2.x(), s.specific_force_mps2.y());
              return true;
            }),
            ImuFault::kDisagrees);
}

TEST(ImuFaults, GravityTakenOut) {
  const inertial_world::SmoothMotion motion(6, 1.5);
  EXPECT_EQ(fault_of([&](ImuSample& s) {
              const double t_s = 1e-9 * static_cast<double>(s.stamp.ns);
              s.specific_force_mps2 -=
                  motion.T_world_imu(t_s).R().transpose() * Vec3(0, 0, kStandardGravity_mps2);
              return true;
            }),
            ImuFault::kGravity);
}

TEST(ImuFaults, ABiasOfNoSensor) {
  EXPECT_EQ(fault_of([](ImuSample& s) {
              s.angular_velocity_radps += Vec3(0.3, 0, 0);
              return true;
            }),
            ImuFault::kBias);
}

TEST(ImuFaults, SamplesThatStop) {
  EXPECT_EQ(fault_of([](ImuSample& s) { return s.stamp.ns < to_ns(2.5); }, true),
            ImuFault::kSilent);
}

TEST(ImuFaults, AGyroscopeThatStands) {
  EXPECT_EQ(fault_of(
                [](ImuSample& s) {
                  if (s.stamp.ns > to_ns(2)) s.angular_velocity_radps = Vec3(0.01, 0.02, 0.01);
                  return true;
                },
                true),
            ImuFault::kStands);
}

TEST(ImuFaults, ReadingsThatAreZero) {
  EXPECT_EQ(fault_of(
                [](ImuSample& s) {
                  if (s.stamp.ns > to_ns(2)) s = {s.stamp, Vec3::Zero(), Vec3::Zero()};
                  return true;
                },
                true),
            ImuFault::kStands);
}

// While it hangs nothing is predicted, and afterwards all is as before.
TEST(ImuFaults, ADriverThatHangsForASecond) {
  std::optional<ImuSample> held;
  const auto hang = [&](ImuSample& s) {
    if (s.stamp.ns < to_ns(7) || s.stamp.ns > to_ns(8)) return true;
    if (!held) held = s;
    held->stamp = s.stamp;
    s = *held;
    return true;
  };
  Drive drive({.seed = 6, .liveliness = 1.5, .distort = hang});
  drive.run(7.15);
  EXPECT_FALSE(drive.estimator().predict(drive.now()));
  drive.run(1);
  EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kStands);
  drive.run(4);
  EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kNone);
  EXPECT_TRUE(drive.estimator().is_trusted());
}

TEST(ImuFaults, OneWrongReadingCostsNothing) {
  for (const auto& [axis, size] : {std::pair(3, 1000.0), {4, 39.0}, {1, 17.0}, {0, 30.0}}) {
    Vec6 wrong = Vec6::Zero();
    wrong[axis] = size;
    bool came = false;
    const auto spike = [&](ImuSample& s) {
      if (s.stamp.ns < to_ns(8.05) || std::exchange(came, true)) return true;
      s.angular_velocity_radps += wrong.head<3>();
      s.specific_force_mps2 += wrong.tail<3>();
      return true;
    };
    Drive drive({.seed = 6, .liveliness = 1.5, .distort = spike});
    drive.run(8);
    drive.run(0.5, false);
    ASSERT_TRUE(came);
    const auto predicted = drive.estimator().predict(drive.now());
    ASSERT_TRUE(predicted);
    EXPECT_LT(drive.error_of(*predicted).head<3>().norm(), 0.05);
    EXPECT_LT(drive.nees_of(*predicted), kMostNees);
    drive.run(1);
    EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kNone);
  }
}

TEST(ImuFaults, FasterThanACameraIsCarried) {
  const auto pull = [](ImuSample& s) {
    if (s.stamp.ns > to_ns(8)) s.specific_force_mps2.y() += 12;
    return true;
  };
  Drive drive({.seed = 6, .distort = pull});
  drive.run(8);
  drive.run(0.2, false);
  EXPECT_TRUE(drive.estimator().predict(drive.now()));
  drive.run(0.4, false);
  EXPECT_FALSE(drive.estimator().predict(drive.now()));
  EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kDisagrees);
}

TEST(ImuFaults, AClockFarOffIsFound) {
  for (const double offset_s : {-0.3, 0.15, 0.2, 0.3}) {
    Drive drive({.seed = 3, .liveliness = 2, .offset_s = offset_s});
    drive.run(15);
    EXPECT_NEAR(drive.estimator().time_offset_s(), offset_s, 3e-3);
    EXPECT_TRUE(drive.estimator().is_trusted());
  }
}

// As a slow or a noisy camera sees it: not to a millisecond.
TEST(ImuFaults, AFarOffsetThatIsKnownBadlyIsFound) {
  for (const double offset_s : {-0.3, 0.015, 0.03, 0.05, 0.15, 0.4}) {
    Drive drive({.seed = 3, .seen_rotation_rad = 0.003, .offset_s = offset_s});
    drive.run(12);
    EXPECT_TRUE(drive.estimator().time_offset_is_known()) << offset_s;
    EXPECT_NEAR(drive.estimator().time_offset_s(), offset_s, 0.012);
    EXPECT_TRUE(drive.estimator().started()) << offset_s;
  }
}

// A clock that is found to be off by little more is no reason to be lost in the dark.
TEST(ImuFaults, ALaterLookAtTheClockDoesNotEndCoasting) {
  for (const double offset_s : {0.004, 0.03}) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      Drive drive({.seed = seed, .offset_s = offset_s});
      drive.run(7);
      if (!drive.estimator().is_trusted()) continue;
      drive.run(3, false);
      const auto predicted = drive.estimator().predict(drive.now());
      ASSERT_TRUE(predicted) << seed;
      EXPECT_LT(drive.error_of(*predicted).head<3>().norm(), 0.15) << seed;
    }
  }
}

TEST(ImuFaults, AClockOfNoOffsetIsTold) {
  Drive drive({.seed = 3, .liveliness = 2, .offset_s = 3});
  bool told = false;
  for (int i = 0; i < 600; ++i) {
    drive.step();
    told |= drive.estimator().take_fault() == ImuFault::kOffset;
    const auto predicted = drive.estimator().predict(drive.now());
    EXPECT_FALSE(predicted && predicted->agreed);
  }
  EXPECT_TRUE(told);
}

TEST(ImuFaults, AToldOffsetThatIsWrongIsNotUsed) {
  for (const double told_s : {0.0, -0.05, 0.3}) {
    Drive drive({.seed = 3, .liveliness = 2, .offset_s = 0.04, .told_offset_s = told_s});
    bool told = false;
    for (int i = 0; i < 450; ++i) {
      drive.step();
      told |= drive.estimator().take_fault() == ImuFault::kToldOffset;
    }
    EXPECT_TRUE(told);
    EXPECT_NEAR(drive.estimator().time_offset_s(), 0.04, 3e-3);
  }
  Drive drive({.seed = 3, .liveliness = 2, .offset_s = 0.04, .told_offset_s = 0.035});
  drive.run(15);
  EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kNone);
  EXPECT_NEAR(drive.estimator().time_offset_s(), 0.035, 1e-9);
}

TEST(ImuFaults, StampsThatGoBackStartAnew) {
  const auto jump = [](ImuSample& s) {
    if (s.stamp.ns > to_ns(2)) s.stamp.ns -= to_ns(50);
    return true;
  };
  EXPECT_EQ(fault_of(jump, true), ImuFault::kClock);
}

TEST(ImuFaults, AClockThatJumpsIsFoundAgain) {
  const auto jump = [](ImuSample& s) {
    if (s.stamp.ns > to_ns(30)) s.stamp.ns += to_ns(0.05);
    return true;
  };
  Drive drive({.seed = 3, .liveliness = 2, .distort = jump});
  drive.run(30);
  ASSERT_TRUE(drive.estimator().is_trusted());
  drive.run(20);
  EXPECT_NEAR(drive.estimator().time_offset_s(), 0.05, 2e-3);
  EXPECT_TRUE(drive.estimator().is_trusted());
}

TEST(ImuFaults, AClockThatJumpsIsNoticedWithinSeconds) {
  for (const double jump_s : {-0.1, 0.1, 0.2}) {
    const auto jump = [&](ImuSample& s) {
      if (s.stamp.ns > to_ns(10)) s.stamp.ns += to_ns(jump_s);
      return true;
    };
    Drive drive({.seed = 3, .distort = jump});
    drive.run(9.9);
    ASSERT_TRUE(drive.estimator().is_trusted());
    bool noticed = false;
    for (int i = 0; i < 9; ++i) {
      drive.run(1);
      const auto predicted = drive.estimator().predict(drive.now());
      noticed |= !predicted || !predicted->agreed;
    }
    EXPECT_TRUE(noticed) << jump_s;
    EXPECT_NEAR(drive.estimator().time_offset_s(), jump_s, 0.012);
  }
}

// Told once, after 2 s.
void expect_unheard(ImuFault expected, const Distortion& distort) {
  Drive drive({.seed = 6, .distort = distort});
  drive.run(1.9);
  EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kNone);
  drive.run(0.3);
  EXPECT_EQ(drive.estimator().take_fault(), expected);
  drive.run(5);
  EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kNone);
}

TEST(ImuFaults, NothingThatCanBeUsedIsToldOnce) {
  expect_unheard(ImuFault::kNoReadings, [](ImuSample&) { return false; });
  expect_unheard(ImuFault::kNoNumbers, [](ImuSample& s) {
    s.angular_velocity_radps.x() = std::numeric_limits<double>::quiet_NaN();
    return true;
  });
  for (const double late_s : {-900.0, 900.0})
    expect_unheard(ImuFault::kOtherTime, [=](ImuSample& s) {
      s.stamp.ns += to_ns(late_s);
      return true;
    });
}

TEST(ImuFaults, OneWildStampCostsNothing) {
  bool is_wild = false;
  const auto distort = [&](ImuSample& s) {
    if (s.stamp.ns > to_ns(3) && !std::exchange(is_wild, true)) s.stamp.ns = to_ns(2147483648.0);
    return true;
  };
  Drive drive({.seed = 7, .distort = distort});
  drive.run(6);
  EXPECT_TRUE(is_wild);
  EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kNone);
  EXPECT_TRUE(drive.estimator().started());
}

TEST(ImuFaults, AShortGapIsBridgedAndCostsCertainty) {
  const auto gap = [](ImuSample& s) { return s.stamp.ns < to_ns(3) || s.stamp.ns > to_ns(3.08); };
  Drive drive({.seed = 7, .distort = gap});
  drive.run(2.98);
  drive.run(0.12, false);
  const auto predicted = drive.estimator().predict(drive.now());
  ASSERT_TRUE(predicted);
  EXPECT_GT(std::sqrt(predicted->covariance.bottomRightCorner<3, 3>().trace()), 0.02);
  EXPECT_LT(drive.nees_of(*predicted), kMostNees);
  drive.run(1);
  EXPECT_TRUE(drive.estimator().started());
  EXPECT_EQ(drive.estimator().take_fault(), ImuFault::kNone);
}

TEST(ImuFaults, AClippedReadingIsNotBelieved) {
  const auto clip = [](ImuSample& s) {
    if (s.stamp.ns > to_ns(3) && s.stamp.ns < to_ns(3.1)) {
      s.angular_velocity_radps.x() = 2.18166;
      s.specific_force_mps2.z() = 19.6133;
    }
    return true;
  };
  Drive drive({.seed = 8, .distort = clip});
  drive.run(2.98);
  drive.run(0.15, false);
  const auto predicted = drive.estimator().predict(drive.now());
  ASSERT_TRUE(predicted);
  EXPECT_GT(std::sqrt(predicted->covariance.bottomRightCorner<3, 3>().trace()), 0.1);
  EXPECT_LT(drive.nees_of(*predicted), kMostNees);
  EXPECT_FALSE(drive.estimator().is_trusted());
  drive.run(3);
  EXPECT_TRUE(drive.estimator().is_trusted());
  const ImuBias found = drive.estimator().state()->state.bias;
  EXPECT_LT((found.gyro_radps - drive.true_bias().gyro_radps).norm(), 1e-3);
}

// Whatever comes: no end of the program, and what is predicted is a pose.
TEST(ImuFaults, AnyReadingsAreSurvived) {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Rng rng(seed);
    const double wrong_share = seed % 4 == 0 ? 0.5 : 0.02;
    const double size = std::pow(10, rng.uniform(-1, 7));
    const auto distort = [&](ImuSample& s) {
      if (rng.uniform() > wrong_share || s.stamp.ns < to_ns(rng.uniform(0, 4))) return true;
      switch (rng.below(5)) {
        case 0:
          s.angular_velocity_radps = inertial_world::normal_vector(rng, size);
          return true;
        case 1:
          s.specific_force_mps2 = inertial_world::normal_vector(rng, size);
          return true;
        case 2:
          s.stamp.ns += to_ns(rng.uniform(-0.1, 0.1) * size);
          return true;
        case 3:
          s.angular_velocity_radps.x() = std::numeric_limits<double>::infinity();
          return true;
        default:
          return false;
      }
    };
    Drive drive({.seed = seed, .distort = distort});
    drive.before_frame = [](Drive& d) {
      const auto predicted = d.estimator().predict(d.now());
      if (!predicted) return;
      EXPECT_TRUE(predicted->T_odom_camera.is_finite());
      EXPECT_TRUE(predicted->covariance.allFinite());
      EXPECT_GE(predicted->covariance.diagonal().minCoeff(), 0);
    };
    for (int i = 0; i < 150; ++i) drive.step(rng.uniform() > 0.1);
  }
}

}  // namespace
}  // namespace ygslam
